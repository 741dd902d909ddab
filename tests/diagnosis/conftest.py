"""Fixtures: the toy case with a diagnosis, and a made-up world with its surfaces."""

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.runs.workspace import Workspace
from tests.toy_laboratory import NUISANCES, SMALL, lab
from tests.toy_world import World


@pytest.fixture
def space(write_case, fake_yade, tmp_path):
    def make(**hidden):
        (tmp_path / "nuisances.csv").write_text(NUISANCES)
        return Workspace(
            read_case(write_case(SMALL, lab=lab(**hidden))), tmp_path / "results" / "toy"
        )

    return make


@pytest.fixture(scope="module")
def world():
    return World(3)


@pytest.fixture(scope="module")
def surfaces(world):
    return world.surfaces(np.random.default_rng(4))
