"""A laboratory that measures what the fake YADE computes, with an effect hidden in it."""

import random

from calibrator.case.vocabulary import RESPONSES
from tests import fake_yade as fake

TRUTH = {"rolling_friction": 0.25, "sliding_friction": 0.5, "young_modulus": 3e6}
HELD_OUT = ("ledge_curvature", "pile_apex_rounding")
SMALL = (
    "[run]",
    """[conditions.wide_neck]
setup = "hourglass"
neck_diameter = 0.016
[diagnosis]
effects = ["bond_number", "bed_viscosity"]
nuisances = "nuisances.csv"
day_error = 0.0
sets = 12
replicates = 2
effect_sets = 8
verify_replicates = 3
[run]""",
)
NUISANCES = """nuisance,observables,error,unit
reading of angles,*_angle_deg,0.05,deg
balance,*mass_flow_rate,0.1,%
neck,effect:bed_viscosity,1e-6,Pa s
"""


def lab(conditions=False, **hidden):
    """Five replicates of everything the fake YADE measures, with an effect hidden in them."""
    rng, rows = random.Random(5), ["setup,condition,response,value,scatter,replicates,unit,role"]
    for setup in ("hourglass", "ledge", "conical_pile"):
        for name, value in fake.responses_of(setup, {**TRUTH, **hidden}).items():
            seen = value * (1 + fake.NOISE * rng.gauss(0, 1) / 5**0.5)
            first = (
                name in ("bulk_density", "mass_flow_rate", "drained_equivalent_angle_deg")
                and setup == "hourglass"
            )
            role = "calibrate" if first else "held_out" if name in HELD_OUT else "diagnose"
            cells = f"{name},{seen!r},{abs(value) * fake.NOISE!r},5,{RESPONSES[name].unit}"
            rows.append(f"{setup},,{cells},{role}")
            if conditions and setup == "hourglass":
                rows.append(f"{setup},wide_neck,{cells},diagnose")
    return "\n".join(rows) + "\n"
