"""Logs of a scale whose rate, release and mass are known."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.laboratory.discharge import GRAVITY, Bench, measure_discharge
from calibrator.laboratory.tables import Run

RATE, TOTAL, RELEASE = 0.020, 0.100, 2.0


def log(mass_of, end=12.0, interval=0.05, noise=0.0, seed=1):
    """A log in which mass_of(time) [kg] is read, with noise [kg] and to a hundredth of a gram."""
    time = np.arange(0, end, interval)
    read = mass_of(time) + np.random.default_rng(seed).normal(0, noise, len(time))
    return Run("log.csv", np.arange(2, len(time) + 2), time, np.round(read, 5))


def steady(time):
    return np.clip(RATE * (time - RELEASE), 0, TOTAL)


def onto_a_pan(height):
    """What the pan under a neck reads: what lies on it, and the force of what hits it."""
    fall = np.sqrt(2 * height / GRAVITY)

    def read(time):
        lies = np.clip(RATE * (time - RELEASE - fall), 0, TOTAL)
        hits = (time > RELEASE + fall) & (time < RELEASE + fall + TOTAL / RATE)
        return lies + hits * RATE * fall

    return read


def values(run, **bench):
    return measure_discharge(run, Bench(**bench)).values


@pytest.mark.parametrize("noise", [0.0, 2e-5])
def test_rate_onset_times_and_mass_of_a_steady_flow_are_found(noise):
    found = values(log(steady, noise=noise), released=RELEASE, fill_mass=0.150)
    assert found["mass_flow_rate"].value == pytest.approx(RATE, rel=2e-3)
    assert found["late_early_ratio"].value == pytest.approx(1, abs=0.01)
    assert found["onset_delay"].value == pytest.approx(0, abs=0.01)
    assert found["discharge_time"].value == pytest.approx(TOTAL / RATE, abs=0.11)
    assert found["emptying_time"].value == pytest.approx(0.95 * TOTAL / RATE, abs=0.06)
    assert found["drained_mass"].value == pytest.approx(TOTAL, abs=2e-5)
    assert found["residual_mass"].value == pytest.approx(0.050, abs=2e-5)
    assert found["residual_fraction"].value == pytest.approx(1 / 3, abs=1e-3)


def test_the_line_of_a_steady_flow_onto_a_pan_needs_no_correction_for_the_fall():
    found = values(log(onto_a_pan(0.2)), fall_height=0.2)
    assert found["mass_flow_rate"].value == pytest.approx(RATE, rel=2e-3)
    assert found["onset_delay"].value == pytest.approx(0, abs=0.05)  # one interval


def test_a_vessel_that_is_weighed_gives_the_same():
    found = values(log(lambda time: 0.5 - steady(time)))
    assert found["mass_flow_rate"].value == pytest.approx(RATE, rel=2e-3)
    assert found["onset_delay"].response


def test_times_without_a_release_are_not_for_the_lab_file():
    reading = measure_discharge(log(steady), Bench())
    assert not reading.values["discharge_time"].response
    assert reading.values["mass_flow_rate"].response
    assert "--fall-height" in " ".join(reading.warnings)


def test_the_error_of_the_rate_is_that_of_repeated_noise():
    some = [
        values(log(steady, noise=3e-4, seed=s), released=2.0)["mass_flow_rate"] for s in range(40)
    ]
    scatter = np.std([one.value for one in some])
    assert 0.5 < np.mean([one.error for one in some]) / scatter < 2


def test_the_equivalent_angle_is_that_of_the_volume_left_behind():
    found = values(
        log(steady),
        released=RELEASE,
        fill_mass=0.150,
        bulk_density=1500.0,
        cylinder_diameter=0.06,
        neck_diameter=0.014,
    )
    slope = np.tan(np.radians(found["drained_equivalent_angle_deg"].value))
    rho = np.linspace(0.007, 0.03, 20001)
    volume = np.sum(2 * np.pi * rho * (rho - 0.007) * slope) * (rho[1] - rho[0])
    assert volume * 1500 == pytest.approx(0.050, rel=1e-3)


def touched(time):
    return steady(time) + 0.01 * ((time > 4) & (time < 4.3))


@pytest.mark.parametrize(
    ("run", "why"),
    [
        (log(touched), "touched"),
        (log(lambda time: steady(time + 3)), "does not start at rest"),
        (log(steady, end=5.0), "does not end at rest"),
        (log(lambda time: 0 * time), "does not change"),
        (log(steady, interval=1.0), "log more often"),
    ],
)
def test_a_log_that_is_no_whole_discharge_is_refused(run, why):
    with pytest.raises(CalibratorError, match=why):
        measure_discharge(run, Bench())


def test_a_gap_within_the_flow_is_refused():
    run = log(steady)
    keep = (run.first < 4) | (run.first > 5)
    gap = Run("log.csv", run.lines[keep], run.first[keep], run.second[keep])
    with pytest.raises(CalibratorError, match=r"line \d+: no reading for 1"):
        measure_discharge(gap, Bench())


def test_time_that_runs_backwards_is_refused():
    run = log(steady)
    time = run.first.copy()
    time[100:] -= 3
    with pytest.raises(CalibratorError, match="line 102: time runs backwards"):
        measure_discharge(Run("log.csv", run.lines, time, run.second), Bench())


def test_a_release_after_the_onset_and_more_than_was_filled_in_are_refused():
    with pytest.raises(CalibratorError, match="before the release"):
        values(log(steady), released=4.0)
    with pytest.raises(CalibratorError, match="more has drained"):
        values(log(steady), fill_mass=0.05)
