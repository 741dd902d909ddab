"""A case whose every value is given, and what `check` says of changes to it."""

import pytest

from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.runs.workspace import Workspace
from tests.conftest import LAB

GIVEN = (
    "[run]",
    """[fixed]
particle_radius = 1e-3
particle_density = 2650.0
restitution = 0.8
[setups.hourglass]
fill_mass = 20e-3
cylinder_diameter = 30e-3
neck_diameter = 16e-3
[setups.ledge]
box_length = 30e-3
box_width = 12e-3
fill_height = 20e-3
[setups.conical_pile]
cylinder_diameter = 34e-3
fill_height = 29e-3
lift_speed = 5e-3
lift_height = 22e-3
[run]""",
)


@pytest.fixture
def checked(write_case, tmp_path, fake_yade):
    """What `check` finds in the given case after replacements, and with another lab file."""

    def check(*changes, lab=LAB):
        return check_case(Workspace(read_case(write_case(GIVEN, *changes, lab=lab)), tmp_path))

    return check
