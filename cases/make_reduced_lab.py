"""Targets of the reduced quartz case from the measurements of the reference paper.

    python -m cases.make_reduced_lab

The measurements belong to a cylinder of 32 mm with a neck of 5 mm. They are carried over by YADE
runs (python -m benchmarks.runs.hourglass_scale, grid/hourglass_scale.csv):

- density and rate by individual D, for which the paper gives its own simulation's values. How it
  measures the filled volume, and when its discharge ends, it does not say; at D the surface scanned
  here gives 5 % more density than its 1594 kg/m3. The target is what the reduced hourglass gives at
  D, times measured over simulated in the paper (of the discharge time the inverse);
- angle by the straight line through three sets of frictions that turns the slope fitted in the wide
  cylinder, which is what the paper measures, into the equivalent angle of the reduced one.
"""

import tomllib
from pathlib import Path

import numpy as np

from benchmarks.runs.hourglass_scale import COMPARED, finished
from calibrator.runs.record import Record

HERE = Path(__file__).resolve().parent
LAB = HERE / "quartz_sand_reduced_lab.csv"
INDIVIDUAL_D = "high"  # the set of frictions that are those of the paper's individual D
HEAD = """# from the measurements on quartz sand in the reference paper (Tables 3, 8 and 9), \
carried over to the reduced hourglass
# python -m cases.make_reduced_lab
setup,response,value,scatter,replicates,unit,role
"""


def mean(records: list[Record], response: str) -> float:
    """Mean response of the runs that have it; nan where none has."""
    values = [r.responses[response] for r in records if response in r.responses]
    return float(np.mean(values)) if values else float("nan")


def at_individual_d(response: str) -> float:
    """What the reduced hourglass gives at individual D, of which it has Young's modulus as well."""
    return mean(finished(INDIVIDUAL_D, "stiff"), response)


def angle(measured: float) -> float:
    """Equivalent angle [deg] in the reduced hourglass for a slope measured in the wide one."""
    pairs = [
        (
            mean(finished(s, "full"), "drained_angle_of_repose_deg"),
            mean(finished(s, "reduced"), "drained_equivalent_angle_deg"),
        )
        for s in COMPARED
    ]
    wide, reduced = np.array([p for p in pairs if np.isfinite(p).all()]).T
    return float(np.polyval(np.polyfit(wide, reduced, 1), measured))


def main() -> None:
    """Write the lab file."""
    tables = tomllib.loads((HERE / "reference_paper.toml").read_text())
    measured, simulated = tables["measured"], tables["individual"]["D"]["verified"]
    density = at_individual_d("bulk_density") * measured["bulk_density"] / simulated["bulk_density"]
    rate = (
        at_individual_d("mass_flow_rate") * simulated["discharge_time"] / measured["discharge_time"]
    )
    rows = [
        ("hourglass", "bulk_density", density, "kg/m3", "calibrate"),
        (
            "hourglass",
            "drained_equivalent_angle_deg",
            angle(measured["drained_angle_of_repose_deg"]),
            "deg",
            "calibrate",
        ),
        ("hourglass", "mass_flow_rate", rate, "kg/s", "calibrate"),
        (
            "ledge",
            "ledge_angle_of_repose_deg",
            measured["ledge_angle_of_repose_deg"],
            "deg",
            "held_out",
        ),
        (
            "conical_pile",
            "pile_angle_of_repose_deg",
            measured["pile_angle_of_repose_deg"],
            "deg",
            "held_out",
        ),
    ]
    LAB.write_text(
        HEAD
        + "".join(f"{s},{r},{value:.5g},,1,{unit},{role}\n" for s, r, value, unit, role in rows)
    )
    print(LAB.read_text(), end="")


if __name__ == "__main__":
    main()
