"""Laboratories whose errors are larger than they say: how they are made, and counted."""

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis.explanations import KNOWN_WITHIN
from calibrator.runs.database import Database
from tests.campaigns.hidden.errors import DAYS, Errors, errors_of
from tests.campaigns.hidden.laboratory import CASE, SHIPPED
from tests.campaigns.hidden.left_out import without
from tests.campaigns.hidden.trials import library, measurements
from tests.campaigns.hidden.unstated import Laboratory, rates


@pytest.fixture(scope="module")
def set_left_out():
    """The case, the runs of one set of the surfaces, and the surfaces without it."""
    case = read_case(CASE)
    rest, values = without(Database.read(SHIPPED), case, 3)
    replicates = min(map(len, values))
    return case, [own[:replicates] for own in values], library(case, rest)


def test_the_error_of_a_day_is_shared_by_replicates_and_as_correlated_as_runs(set_left_out):
    case, runs, judged = set_left_out

    def drawn(day, times):
        errors = Errors(day, 1, {n.name: times for n in case.nuisances})
        return np.array(
            [
                measurements(case, runs, judged, np.random.default_rng(seed), errors).values
                for seed in range(300)
            ]
        )

    noise, scatter = judged.surfaces.noise, np.sqrt(np.diag(judged.surfaces.noise))
    more = np.cov(drawn(0.5, 0.0).T)
    np.testing.assert_allclose(np.sqrt(np.diag(more)), 0.5 * scatter, rtol=0.2)
    correlation = more / np.outer(0.5 * scatter, 0.5 * scatter)
    np.testing.assert_allclose(correlation, noise / np.outer(scatter, scatter), atol=0.25)
    assert np.ptp(drawn(0.0, 0.0), axis=0).max() == 0
    once, twice = (np.ptp(drawn(0.0, times), axis=0) for times in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2 * once, rtol=0.05)  # errors of reading are scaled, too


def test_a_laboratory_is_named_where_all_its_trials_are_and_alarms_where_any_does():
    words = [
        (Laboratory("a", "", (), None), ["no gap", "ambiguous"]),
        (Laboratory("b", "", (), None), ["no gap", "no gap"]),
        (Laboratory("c", "tilt_deg", (), None), ["tilt_deg", "tilt_deg"]),
        (Laboratory("d", "tilt_deg", (), None), ["tilt_deg", "bond_number"]),
    ]
    found = rates(words)
    assert found["nothing_hidden"]["false_alarms"]["laboratories"] == [1, 2]
    assert found["nothing_hidden"]["names"]["laboratories"] == [0, 2]
    assert found["strong"]["named"]["laboratories"] == [1, 2]
    assert found["strong"]["named"]["trials"] == [3, 4]
    assert found["strong"]["another_name"]["laboratories"] == [1, 2]


def test_replicates_of_several_days_share_the_error_of_their_own_day_only():
    errors, noise = Errors(2.0, 3), np.diag([1.0, 4.0])
    rng = np.random.default_rng(1)
    drawn = np.array([errors.of_days(np.zeros((5, 2)), noise, rng) for _ in range(2000)])
    np.testing.assert_array_equal(drawn[:, 0], drawn[:, 3])
    assert abs(np.corrcoef(drawn[:, 0, 0], drawn[:, 1, 0])[0, 1]) < 0.1
    np.testing.assert_allclose(drawn[:, 0].std(axis=0), [2.0, 4.0], rtol=0.1)


def test_a_laboratory_of_the_campaign_knows_its_errors_within_a_factor_of_two():
    nuisances = read_case(CASE).nuisances
    several = [errors_of(nuisances, index) for index in range(200)]
    times = np.array([list(one.times.values()) for one in several])
    assert times.shape[1] == len(nuisances) and 1 / KNOWN_WITHIN <= times.min() < 0.55
    assert 1.8 < times.max() <= KNOWN_WITHIN
    assert {(one.day, one.days) for one in several} == {(1.0, DAYS)}
