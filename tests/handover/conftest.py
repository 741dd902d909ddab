"""What tests of exports and of cards share."""

import pytest

from calibrator.plan.run import collect, run_plan
from tests.conftest import space_for


@pytest.fixture
def space(write_case, tmp_path, fake_yade):
    """A case whose runs are made, by the fake YADE, and gathered."""
    found = space_for(write_case(("sets = 14", "sets = 8")), tmp_path / "results")
    for verb in (run_plan, collect):
        verb(found)
    return found
