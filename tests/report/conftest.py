"""Fixtures: a finished calibration and a finished diagnosis, each made once."""

import pytest

from calibrator.report.page import write_report
from tests.report.made_up import diagnosed, finished, workspace


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """A finished calibration: workspace, outcome of the report, page. Not to be changed."""
    space = finished(workspace(tmp_path_factory.mktemp("whole")))
    return space, write_report(space), (space.path / "report.html").read_text()


@pytest.fixture(scope="session")
def named(tmp_path_factory):
    """A diagnosis that names adhesion: workspace, outcome, page. Not to be changed."""
    space, found = diagnosed(tmp_path_factory.mktemp("named"), bond_number=0.6)
    return space, found, (space.path / "diagnosis.html").read_text()
