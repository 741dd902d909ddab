"""The shipped databases belong to the shipped cases and to this version of the contract."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.plan.requests import plan_requests
from calibrator.runs.database import Database

REPO = Path(__file__).resolve().parent.parent


def test_the_shipped_database_answers_the_whole_plan_of_the_demo():
    database = Database.read(REPO / "grid" / "coarse_sand.csv")
    requests = plan_requests(read_case(REPO / "cases" / "coarse_sand.toml"))
    assert len(database.find(requests)) == len(requests)


def test_the_lab_file_is_the_mean_of_its_shipped_runs():
    runs = Database.read(REPO / "grid" / "coarse_sand_lab_runs.csv").records.values()
    problem = read_case(REPO / "cases" / "coarse_sand.toml").problem
    for target in (*problem.targets, *problem.held_out):
        values = [r.responses[target.response] for r in runs if r.request.setup == target.setup]
        assert target.value == pytest.approx(
            np.mean(values), rel=1e-5
        ) and target.replicates == len(values)
        assert target.scatter == pytest.approx(np.std(values, ddof=1), rel=0.01)


def test_the_lab_shares_no_run_and_no_parameter_set_with_the_database_of_the_demo():
    lab = Database.read(REPO / "grid" / "coarse_sand_lab_runs.csv").records.values()
    own = Database.read(REPO / "grid" / "coarse_sand.csv").records.values()
    assert not {r.request.parameters["seed"] for r in lab} & {
        r.request.parameters["seed"] for r in own
    }
    assert not {r.request.parameters["rolling_friction"] for r in lab} & {
        r.request.parameters["rolling_friction"] for r in own
    }


@pytest.mark.parametrize("path", sorted((REPO / "grid").glob("*.csv")), ids=lambda p: p.name)
def test_every_shipped_file_is_described(path):
    assert f"`{path.name}`" in (REPO / "grid" / "README.md").read_text()


def test_every_shipped_file_has_the_checksum_that_was_published():
    """A database edited by hand, or cut short on its way, is noticed.

    After a change: cd grid && sha256sum *.csv > SHA256SUMS.
    """
    lines = (REPO / "grid" / "SHA256SUMS").read_text().splitlines()
    published = {name: digest for digest, name in (line.split() for line in lines)}
    assert published == {
        p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in (REPO / "grid").glob("*.csv")
    }
