"""The verb `view`: one run as a picture, an animation, and files for ParaView."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.files import own_folder, write_bytes, write_text
from calibrator.runs.record import Record
from calibrator.runs.setups import SETUP_ENTRIES
from calibrator.runs.workspace import Report, Workspace, silent
from calibrator.view import vtk
from calibrator.view.animation import animation
from calibrator.view.camera import CAMERAS, Camera
from calibrator.view.choice import choose
from calibrator.view.drawing import BANDS, Scene, picture, scene_of
from calibrator.view.names import FEWEST, FRAMES, MOST
from calibrator.view.outcome import ANIMATION, PICTURE, VIEW, View, place, write_view
from calibrator.view.snapshots import Film, Snapshot, read_snapshot
from calibrator.view.watched import SNAPSHOTS, same, watch


def view_run(
    space: Workspace,
    report: Report = silent,
    run: str = "",
    setup: str = "",
    frames: int = FRAMES,
    anyway: bool = False,
) -> View:
    """Make a run again with snapshots, and draw it.

    Snapshots that are there are not made again; the run's record, and its id, stay as they are.

    Parameters
    ----------
    run : a run id or its beginning, or a candidate; the compromise where empty.
    setup : experiment of a candidate's run; the case's first where empty.
    frames : of the animation, at most; anyway : show a run also where it is not the noted one.

    Raises
    ------
    CalibratorError, with what to do, where there is no such run, YADE is missing, the run has no
    frames, or is another one than was noted.
    """
    if not FEWEST <= frames <= MOST:
        raise CalibratorError(f"--frames {frames}: give a number from {FEWEST} to {MOST}")
    choice = choose(space, run, setup)
    space.folder("views")
    folder = own_folder(place(space, choice.request))
    record = watch(space, choice.request, folder / "run", report)
    is_same = same(choice.record, record, anyway)
    film = Film.read(folder / "run" / SNAPSHOTS)
    scene = _scene(record, film)
    shots = [read_snapshot(film.paths[i]) for i in film.chosen(frames)]
    four = [read_snapshot(film.paths[i]) for i in film.moments()]
    made = View(
        run_id=record.run_id,
        setup=record.request.setup,
        candidate=choice.candidate,
        status=record.status,
        same=is_same,
        frames=len(shots),
        seen=_seen(record, four, scene),
        picture=folder / PICTURE,
        animation=folder / ANIMATION,
        grains=folder / "grains.pvd",
        walls=folder / "walls.pvd",
    )
    _write(made, folder, four, shots, scene)
    return space.note("view", made)


def _write(
    made: View, folder: Path, four: Sequence[Snapshot], shots: Sequence[Snapshot], scene: Scene
) -> None:
    """Write all files of a view; it counts as there only once they are."""
    (folder / VIEW).unlink(missing_ok=True)
    write_bytes(made.picture, picture(four, scene))
    write_bytes(made.animation, animation(shots, scene))
    _write_vtk(made, folder, shots, scene)
    write_view(made, folder)


def _scene(record: Record, film: Film) -> Scene:
    """What all frames share: the eye, the colours of the layers, what is shown."""
    request = record.request
    camera = CAMERAS.get(request.setup, Camera(0, 22))
    tilt = request.value("tilt_deg")
    assert not isinstance(tilt, str)
    filled, last = (read_snapshot(film.paths[i]) for i in (film.filled, -1))
    leaning = dataclasses.replace(camera, tilt_deg=float(tilt))
    ending = "at rest" if record.status in ("ok", "clogged") else record.status.replace("_", " ")
    return scene_of(filled, last, leaning, SETUP_ENTRIES[request.setup].cut, ending)


def _seen(record: Record, shots: Sequence[Snapshot], scene: Scene) -> str:
    """What the picture shows, for who cannot see it."""
    counts = [len(np.unique(shot.clumps)) for shot in shots]
    grains = "clumps" if len(shots[0].ids) > counts[0] else "grains"
    moments = ", ".join(f"{s.time - scene.released:.2f} s" for s in shots[1:])
    cut = "; those in front of the axis are cut away" if scene.cut else ""
    return (
        f"A {record.request.setup.replace('_', ' ')} in YADE, seen from a little above: {counts[0]}"
        f" {grains} when it is filled, in {BANDS} level layers of two colours by turns, and"
        f" {moments} after the release, when {counts[-1]} are left at the end of the run"
        f" ({record.status}){cut}."
    )


def _write_vtk(made: View, folder: Path, shots: Sequence[Snapshot], scene: Scene) -> None:
    """A file per frame for spheres and one for walls, and their collections over time."""
    shutil.rmtree(folder / "vtk", ignore_errors=True)
    own_folder(folder / "vtk")
    names = [f"{i:03d}.vtp" for i in range(len(shots))]
    for name, shot in zip(names, shots, strict=True):
        layers = np.array([scene.bands.get(int(c), BANDS) for c in shot.clumps], dtype=int)
        fields = {
            "radius": shot.radii,
            "speed": shot.speeds,
            "layer": layers,
            "grain": shot.clumps,
        }
        write_text(folder / "vtk" / f"grains_{name}", vtk.spheres(shot.centres, fields))
        write_text(folder / "vtk" / f"walls_{name}", vtk.triangles(shot.facets))
    times = [shot.time for shot in shots]
    for path, kind in ((made.grains, "grains"), (made.walls, "walls")):
        vtk.write_collection(path, times, [f"vtk/{kind}_{name}" for name in names])
