"""A stand-in for yade and yade-batch that can crash, hang, lie and write half a file.

It honours the contract. Responses are a formula with seeded scatter, so that a whole calibration
has a known answer. What a run does instead is written in misbehave.json of the working folder,
{"<seed>": what} with what = "crash", "segfault", "memory", "hang", "hang once", "lie", "half",
"clog", "unstable", "busy", "killed", "walk" or "nothing"; "all" stands for every seed. With
{"once": true} each seed does so the first time only. {"duration": seconds} makes runs last,
{"yade": version} is what records say, and {"clock": seconds} moves the clock while a run is under
way.
"""

import ast
import itertools
import json
import math
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent.parent / "yade_scripts"
sys.path.insert(0, str(SCRIPTS))
import contract  # noqa: E402

NOISE = 0.004  # relative scatter of one run


def responses_of(setup: str, p: dict) -> dict[str, float]:
    """Smooth made-up responses: monotonic in both frictions, looser where grains are soft."""
    rolling, sliding, soft = (
        p["rolling_friction"],
        p["sliding_friction"],
        math.log10(p["young_modulus"] / 1e6),
    )
    sticky, drag = p.get("bond_number", 0.0), p.get("bed_viscosity", 0.0) / 1e-3
    density = 1700 - 120 * sliding - 90 * rolling - 25 * soft - 60 * sticky
    angle = 20 + 45 * math.tanh(2 * rolling) + 12 * sliding + 6 * sticky
    if setup == "hourglass":
        return {
            "bulk_density": density,
            "drained_equivalent_angle_deg": angle,
            "mass_flow_rate": (0.03 - 0.008 * sliding - 0.003 * sticky) / (1 + 0.1 * drag),
            "late_early_ratio": 0.9 - 0.1 * rolling - 0.1 * sticky,
            "onset_delay": 0.02 * (1 + 0.2 * drag),
        }
    if setup == "ledge":
        return {
            "bulk_density": density,
            "ledge_equivalent_angle_deg": 0.8 * angle,
            "ledge_curvature": -20 - 10 * rolling,
        }
    if setup == "rotating_drum":
        steeper = 0.9 * angle + 0.1 * p["rotation_rpm"]
        return {"drum_angle_deg": steeper, "drum_filled_share": 0.5 + 0.05 * sliding}
    heap = 0.5 * angle + 5 * sticky
    return {
        "bulk_density": density,
        "pile_equivalent_angle_deg": heap,
        "pile_apex_rounding": 1e-3 * (1 + sliding - 0.4 * sticky),
    }


def run_line() -> None:
    """What `yade -n -x script.py` does with the table line in YADE_BATCH.

    Without one it is asked what it is (calibrator/runs/machine.py).
    """
    if "YADE_BATCH" not in os.environ:
        print("calibrator asks: " + json.dumps(["fake", "3.11", ["MADE_UP"], ""]))
        return
    setup, run_id, given = _table_line()
    what = trouble(run_id, given["seed"])
    behave(setup, run_id, contract.checked(setup, given), what)


def run_real_line(yade: str) -> None:
    """The same on the real YADE, apart from the runs that are to go wrong before it starts."""
    if "YADE_BATCH" in os.environ:
        _, run_id, given = _table_line()
        trouble(run_id, given["seed"])
    os.execv(yade, [yade, *sys.argv[1:]])


def _table_line() -> tuple[str, str, dict]:
    """Set-up, run id and parameters of the line."""
    table, line = os.environ["YADE_BATCH"].rsplit(":", 1)
    lines = Path(table).read_text().splitlines()
    cells = dict(zip(lines[0].split(), lines[int(line) - 1].split(), strict=True))
    run_id = cells.pop("description")
    setup = Path(sys.argv[-1]).stem
    own = contract.parameters_of(setup)
    return (
        setup,
        run_id,
        {name: ast.literal_eval(cell) for name, cell in cells.items() if name in own},
    )


def trouble(run_id: str, seed: int) -> str:
    """Note the call, and end, die or hang where that is planned; else returns what is planned.

    The note has the node of a cluster.
    """
    with open("calls.txt", "a") as stream:
        stream.write(f"{run_id} {os.environ.get('SLURMD_NODENAME', '')}".rstrip() + "\n")
    plan = planned()
    what = plan.get(str(seed), plan.get("all", "good"))
    if plan.get("once") and not first_time(run_id):
        what = "good"
    time.sleep(float(plan.get("duration", 0)))
    if what == "crash":
        sys.exit("fake crash")
    if what == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if what == "walk" and calls_of(run_id) < 3:  # killed, but each time with a new checkpoint
        scene = Path("checkpoints", run_id, f"step_{calls_of(run_id)}.bin.gz")
        scene.parent.mkdir(exist_ok=True)
        scene.write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    while what == "busy":
        pass
    if what == "memory":
        block = b"x" * 600_000_000
        time.sleep(3600 if block else 0)
    if what == "hang" or (what == "hang once" and first_time(run_id)):
        time.sleep(3600)
    if what == "nothing":
        sys.exit()
    return what


def planned() -> dict:
    """What misbehave.json says."""
    return json.loads(Path("misbehave.json").read_text()) if Path("misbehave.json").exists() else {}


def behave(setup: str, run_id: str, p: dict, what: str) -> None:
    """Write the record, or a wrong one."""
    plan = planned()
    scatter = random.Random(run_id)
    responses = {
        n: v * (1 + NOISE * scatter.gauss(0, 1)) for n, v in responses_of(setup, p).items()
    }
    record = dict(
        schema=contract.CONTRACT["schema"], setup=setup, run_id=run_id,
        parameters=contract.echoed(p), status="ok", responses=responses, error=None,
        diagnostics=dict(particles=100, steps=1000, filling_cpu=1.0, release_cpu=1.0),
        provenance=dict(
            yade=plan.get("yade", "fake"), scripts="fake", host="fake", started=time.time(),
            wall_time=2.0 + plan.get("clock", 0)
        ),
    )  # fmt: skip
    if what == "lie":
        record["parameters"] = {**p, "rolling_friction": p["rolling_friction"] + 1e-9}
    if what == "clog":
        record.update(status="clogged", responses={"bulk_density": responses["bulk_density"]})
    if what == "unstable":
        record.update(status="unstable", responses={}, error=f"a grain moves at {scatter.random()}")
    if what == "half":
        os.makedirs("records", exist_ok=True)
        Path("records", run_id + ".json").write_text(json.dumps(record)[:100])
        return
    if Path(sys.argv[-1]).parent.name == "watched":
        write_snapshots(p)
    contract.write_record("records", run_id, record, {})


def write_snapshots(p: dict) -> None:
    """What yade_scripts/watch leaves: made-up grains that fall, and half of which then go."""
    import numpy as np

    os.makedirs("snapshots", exist_ok=True)
    radius, drawn = p["particle_radius"], np.random.default_rng(p["seed"])
    rest = radius * drawn.uniform((-8, -8, 0), (8, 8, 16), (60, 3))
    turn = 2 * np.pi * np.arange(13) / 12
    rim = 9 * radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    up = np.array([0, 0, 40 * radius])
    sides = itertools.pairwise(rim)
    facets = [f for a, b in sides for f in ((a, b, b + up), (a, b + up, a + up))]
    for stage, look in [(0, i) for i in range(1, 7)] + [(1, i) for i in range(12)]:
        left = 60 if stage == 0 else 60 - 3 * min(look, 9)
        fall = max(6 - look, 0) if stage == 0 else 0
        np.savez_compressed(
            f"snapshots/{stage}_{look:09d}.npz", stage=stage, time=0.01 * (7 * stage + look),
            ids=np.arange(left), clumps=np.arange(left), radii=np.full(left, radius),
            centres=rest[:left] + np.array([0, 0, fall * radius]), facets=np.array(facets),
            speeds=np.full(left, 0.1 * (fall if stage == 0 else max(9 - look, 0))),
            planes=np.array([[2.0, 0.0]]),
        )  # fmt: skip


def first_time(run_id: str) -> bool:
    """True for the first run of an id in this folder, which calls.txt has noted already."""
    return calls_of(run_id) == 1


def calls_of(run_id: str) -> int:
    """How often a run was started in this folder, this time included."""
    return Path("calls.txt").read_text().split().count(run_id)


def run_batch() -> None:
    """What yade-batch does: every line through --executable in turn, log and summary."""
    arguments = [a for a in sys.argv[1:] if a != "--disable-pynotify"]
    position = next(i for i in range(0, len(arguments), 2) if not arguments[i].startswith("-"))
    options = dict(zip(arguments[:position:2], arguments[1:position:2], strict=True))
    table, *scripts = arguments[position:]
    header, *lines = Path(table).read_text().splitlines()
    for number, line in enumerate(lines, 2):
        cells = dict(zip(header.split(), line.split(), strict=True))
        script = cells.get("!SCRIPT") or scripts[0]
        log = options["--log"].replace("@", line.split()[0])
        with open(log, "w") as stream:
            code = subprocess.run(
                [options["--executable"], "--threads=1", "--nice=0", "-x", script],
                env={**os.environ, "YADE_BATCH": f"{table}:{number}"}, stdout=stream, stderr=stream,
            ).returncode  # fmt: skip
        with open(log, "a") as stream:
            status = code << 8 if code >= 0 else -code  # as os.system returns it
            stream.write(
                f"\n=================== JOB SUMMARY ================\nstatus  : {status} (x)\n"
            )


if __name__ == "__main__":
    run_batch() if Path(sys.argv[0]).name == "yade-batch" else run_line()
