"""What the verb `view` leaves of a run, as a value, and where."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.codec import build, plain
from calibrator.errors import CalibratorError
from calibrator.files import parse_json, read_text, write_text
from calibrator.runs.request import Request
from calibrator.runs.workspace import Workspace

PICTURE, ANIMATION, VIEW = "picture.png", "animation.gif", "view.json"


@dataclass(frozen=True)
class View:
    """Outcome of the verb `view`.

    Attributes
    ----------
    run_id, setup : of the run; candidate : whose it is, empty where a run was named.
    status : how the run ended.
    same : whether it is the noted run, bit for bit; None where none was noted before.
    frames : of the animation; seen : what the picture shows, in words.
    picture, animation : PNG and GIF; grains, walls : collections of files for ParaView.
    """

    run_id: str
    setup: str
    candidate: str
    status: str
    same: bool | None
    frames: int
    seen: str
    picture: Path
    animation: Path
    grains: Path
    walls: Path

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        whose = f" of {self.candidate}" if self.candidate else ""
        noted = {
            True: "the noted run, bit for bit",
            False: "NOT the noted run, but the one that these scripts and this YADE make of it",
            None: "not noted before",
        }[self.same]
        return [
            f"{self.setup} run {self.run_id}{whose}, {self.status}; {noted}",
            f"  picture: {self.picture}",
            f"  animation of {self.frames} frames: {self.animation}",
            f"  for ParaView: {self.grains}, {self.walls}",
        ]


def place(space: Workspace, request: Request) -> Path:
    """The folder of a run's view, which need not be there."""
    return space.path / "views" / request.run_id


def write_view(view: View, folder: Path) -> None:
    """Note a view beside its files; it is there only once they all are."""
    write_text(folder / VIEW, json.dumps(plain(view), indent=1) + "\n")


def read_view(folder: Path) -> View | None:
    """The view of a run that lies in a folder; None where there is none that can be read."""
    try:
        return build(View, parse_json(read_text(folder / VIEW, 1, links=False)), "view")
    except (OSError, ValueError, CalibratorError):
        return None
