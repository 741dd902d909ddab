"""Three conical piles of real YADE runs, and what their records say.

Made with YADE 2023.02a by `yade-batch piles.table yade_scripts/conical_pile.py`, in all of them
particle_radius 1e-3, young_modulus 1e6, fill_height 0.03, cylinder_diameter 0.03, and

    description  rolling_friction  sliding_friction  lift_speed  seed
    middle       0.15              0.4               0.04        12
    steep        0.4               0.6               0.04        11
    steepest     1.0               0.9               0.02        14

The array `final` of each record, in steps of 2e-6 m, is data/piles.npz.
"""

from pathlib import Path

import numpy as np

RADIUS = 1e-3
RECORDED = {
    "steepest": {
        "pile_angle_of_repose_deg": 35.417,
        "pile_equivalent_angle_deg": 33.08,
        "pile_asymmetry_deg": -0.784,
    },
    "steep": {
        "pile_angle_of_repose_deg": 25.937,
        "pile_equivalent_angle_deg": 23.494,
        "pile_asymmetry_deg": 1.409,
    },
    "middle": {
        "pile_angle_of_repose_deg": 14.453,
        "pile_equivalent_angle_deg": 15.389,
        "pile_asymmetry_deg": 0.072,
    },
}


def pile(name):
    """Centres (n, 3) [m] of a run's grains."""
    with np.load(Path(__file__).with_name("data") / "piles.npz") as arrays:
        return arrays[name] * 2e-6
