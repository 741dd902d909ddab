"""A heap with the exported contact law in LIGGGHTS and LAMMPS, beside YADE's shipped heaps."""

import numpy as np
import pytest

from benchmarks.runs import rolling_stiffness
from calibrator.handover.measured import GAPS, HEAP
from calibrator.runs.request import Request
from tests.handover.engines import bulk, each_engine
from tests.handover.materials import material

PAIR, SEEDS = (0.3, 0.5), rolling_stiffness.SEEDS[:2]
DENSITY = "bulk_density"


@pytest.mark.slow
@each_engine
def test_a_heap_in_the_other_engine_is_yades_within_what_was_measured_and_the_noise(
    engine, tmp_path
):
    """A rolling coefficient that is wrong by a factor of 2 moves it by 4 degrees."""
    found = []
    for seed in SEEDS:
        p = rolling_stiffness.parameters("conical_pile", PAIR, seed)
        elastic = dict(young_modulus=p["young_modulus"], restitution=p["restitution"])
        chosen = material(rolling_friction=PAIR[0], sliding_friction=PAIR[1], **elastic)
        folder = tmp_path / str(seed)
        folder.mkdir()
        whole = Request.of("conical_pile", **p).parameters
        status, own = bulk(engine, "conical_pile", chosen, whole, folder)
        assert status == "ok"
        found.append(own)
    angles = yades("pile_equivalent_angle_deg")
    gap = next(g for g in GAPS if (g.engine.lower(), g.ratio, g.response) == (engine, 4.0, HEAP))
    mean = np.mean([one["pile_equivalent_angle_deg"] for one in found])
    noise = angles.std(ddof=1) * np.sqrt(1 / len(SEEDS) + 1 / len(angles))
    assert abs(angles.mean() - gap.by_pair[2] - mean) < 3 * noise < 2.5
    densities = yades(DENSITY)
    mean = np.mean([one[DENSITY] for one in found])
    assert mean == pytest.approx(densities.mean(), rel=0.02)


def yades(response):
    """YADE's shipped runs at the default spring: one value per seed."""
    return rolling_stiffness.samples("conical_pile", response)[PAIR]["4"]
