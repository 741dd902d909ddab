"""Make the synthetic measurement behind the demo, with seeds of its own.

    python cases/make_lab.py          about 15 minutes on two cores

Runs YADE at the parameters of coarse_sand_truth.toml, and writes cases/coarse_sand_lab.csv. The
case file does not contain the true values, and no other run of the project uses these seeds.
"""

import sys
import tomllib
from pathlib import Path

import numpy as np

from calibrator.case.lab import COLUMNS
from calibrator.case.vocabulary import RESPONSES, parameters_of
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.terminal import ProgressBar

CASES = Path(__file__).resolve().parent
FIRST_SEED = 770_000
# Finer than the calibration's: a measurement does not share the numerics of the model.
NUMERICS = {"rayleigh_fraction": 0.2, "filling_kinetic_energy": 1e-12}
REPLICATES = {"hourglass": 8, "ledge": 6, "conical_pile": 6}
ROLES = {
    ("hourglass", "bulk_density"): "calibrate",
    ("hourglass", "drained_equivalent_angle_deg"): "calibrate",
    ("hourglass", "mass_flow_rate"): "calibrate",
    ("hourglass", "discharge_time"): "diagnose",
    ("hourglass", "emptying_time"): "diagnose",
    ("hourglass", "drained_angle_of_repose_deg"): "diagnose",
    ("ledge", "ledge_equivalent_angle_deg"): "held_out",
    ("ledge", "ledge_angle_of_repose_deg"): "held_out",
    ("conical_pile", "pile_equivalent_angle_deg"): "held_out",
    ("conical_pile", "pile_angle_of_repose_deg"): "held_out",
}
NOTE = """synthetic measurement, made by cases/make_lab.py: YADE at the parameters of \
coarse_sand_truth.toml
value = mean over replicates (seeds from {seed} on), scatter = standard deviation of one replicate
raw runs: grid/coarse_sand_lab_runs.csv; YADE {yade}, scripts {scripts}"""


def requests() -> list[Request]:
    """The replicates of each set-up at the true parameters."""
    case = tomllib.loads((CASES / "coarse_sand.toml").read_text())
    truth = tomllib.loads((CASES / "coarse_sand_truth.toml").read_text())["parameters"]
    asked = []
    for setup, count in REPLICATES.items():
        own = parameters_of(setup)
        common = (
            {n: v for n, v in {**case["fixed"], **truth}.items() if n in own}
            | case["setups"][setup]
            | NUMERICS
        )
        asked += [Request.of(setup, **common, seed=FIRST_SEED + i) for i in range(count)]
    return asked


def main() -> None:
    """Run, and write the lab file and the raw runs."""
    records = run(
        RunFolder(Path("results") / "coarse_sand_lab"), requests(), report=ProgressBar(sys.stderr)
    )
    good = [r for r in records if r.status == "ok"]
    provenance = good[0].provenance
    lines = [f"# {line}" for line in NOTE.format(seed=FIRST_SEED, **provenance).splitlines()] + [
        ",".join(COLUMNS)
    ]
    for (setup, response), role in ROLES.items():
        values = [
            r.responses[response]
            for r in good
            if r.request.setup == setup and response in r.responses
        ]
        row = [
            setup,
            response,
            f"{np.mean(values):.6g}",
            f"{np.std(values, ddof=1):.3g}",
            str(len(values)),
            RESPONSES[response].unit,
            role,
        ]
        lines.append(",".join(row))
    (CASES / "coarse_sand_lab.csv").write_text("\n".join(lines) + "\n")
    Database(records).write(
        CASES.parent / "grid" / "coarse_sand_lab_runs.csv",
        "replicates behind cases/coarse_sand_lab.csv",
    )


if __name__ == "__main__":
    main()
