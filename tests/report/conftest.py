"""Fixtures: a finished calibration, made once."""

import pytest

from calibrator.report.page import write_report
from tests.report.made_up import finished, workspace


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """A finished calibration: workspace, outcome of the report, page. Not to be changed."""
    space = finished(workspace(tmp_path_factory.mktemp("whole")))
    return space, write_report(space), (space.path / "report.html").read_text()
