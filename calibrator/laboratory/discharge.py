"""The log of a scale: mass against time while a vessel drains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calibrator.errors import CalibratorError, Mistakes
from calibrator.laboratory.outcome import Reading, Value
from calibrator.laboratory.scripts import scripts_measure
from calibrator.laboratory.tables import Run

GRAVITY = 9.81  # [m/s2], as in yade_scripts/material.py
REST = 3  # readings at rest that a log has to begin and to end with
LOOSE, TIGHT = 0.005, 3.0  # at rest: share of the whole change; standard deviations of the noise
TOUCH = 0.01  # a step against the flow beyond this share of the whole change is no noise
GAP, LONG_GAP = 5.0, 0.05  # over the usual interval; over the time of the discharge


@dataclass(frozen=True)
class Bench:
    """What is known of the discharge beside the log; None: not known.

    released : when the neck was opened, by the log's own clock [s]; fall_height : of the neck above
    the pan, or what stands on it [m]; fill_mass [kg] of what was filled in; bulk_density [kg/m3] of
    the filling; cylinder_diameter and neck_diameter [m].
    """

    released: float | None = None
    fall_height: float | None = None
    fill_mass: float | None = None
    bulk_density: float | None = None
    cylinder_diameter: float | None = None
    neck_diameter: float | None = None


@dataclass(frozen=True)
class _Log:
    """A log between rest and rest: sign of the flow, noise and resolution [kg], first and last."""

    time: np.ndarray
    mass: np.ndarray
    noise: float
    first: int
    last: int


def measure_discharge(run: Run, bench: Bench) -> Reading:
    """Rate, times, ratio of rates, fluctuation and drained mass of one log.

    The mass may rise (what flows out is weighed) or fall (the vessel is). While grains hit what
    they are weighed in at a steady rate Q, those in the air lack Q t_fall of its weight, and the
    impact presses with Q v = Q g t_fall: the two cancel, and the steady line is that of the mass
    which has passed the neck (momentum balance of pan and stream together). So the line needs no
    correction for the fall, and only the first reading that rises comes late by it.

    Raises CalibratorError for a log that cannot be one discharge, with what to do.
    """
    mistakes = Mistakes()
    mistakes.note(_disorder(run))
    mistakes.raise_any()
    log = _between_rests(run)
    mistakes.note(_touched(run, log))
    mistakes.note(_long_gaps(run, log))
    mistakes.raise_any()
    begin, origin, warnings = _release(run, log, bench)
    # the features are taken from the release to the first reading of the final rest
    chosen = slice(int(np.searchsorted(log.time, begin)), log.last + 1)
    time = np.concatenate([[0.0], log.time[chosen] - begin])
    mass = _monotone(np.concatenate([[0.0], log.mass[chosen]]))
    features = scripts_measure().discharge_features(time, mass)
    if not features:
        raise CalibratorError(
            f"{run.source}: fewer than ten readings lie on the steady part of the flow, 20 to 70 %"
            " of the mass; let the scale log more often, or take more sand"
        )
    values = _values(log, features, begin, origin, bench)
    warnings += _doubts(run, log, features)
    curve = (tuple(map(float, time)), tuple(map(float, mass))) if origin else ((), ())
    return Reading(run.source, values, _notes(run, log, origin, bench), tuple(warnings), curve)


def _disorder(run: Run) -> list[str]:
    """What is wrong with the times."""
    steps = np.diff(run.first)
    wrong = [
        f"{run.source} line {run.lines[i + 1]}: time runs backwards; put an empty line or a column"
        " run between repeats, and seconds instead of a clock that passes midnight"
        for i in np.flatnonzero(steps < 0)
    ]
    if len(run.first) < 2 * REST + 10:
        wrong.append(f"{run.source}: only {len(run.first)} readings; let the scale log more often")
    elif not wrong and np.mean(steps == 0) > 0.05:
        wrong.append(
            f"{run.source}: {np.sum(steps == 0)} readings have the time of the one before; log"
            " times with more decimals"
        )
    return wrong


def _between_rests(run: Run) -> _Log:
    """The change of mass since the rest before the flow, positive, and where the flow lies."""
    change = float(np.median(run.second[-REST:]) - np.median(run.second[:REST]))
    if change == 0:
        raise CalibratorError(
            f"{run.source}: the mass does not change; is this the log of a discharge, and are its"
            " columns named?"
        )
    sign = float(np.sign(change))
    away = sign * (run.second - np.median(run.second[:REST]))
    first = _last_within(away, LOOSE * abs(change))
    if first < REST:
        raise CalibratorError(
            f"{run.source} does not start at rest: let the scale log for a few seconds before the"
            f" neck is opened, at least {REST} readings"
        )
    base = away[:first]
    away = away - float(base.mean())
    backwards = _last_within(float(np.median(away[-REST:])) - away[::-1], LOOSE * abs(change))
    if backwards < REST:
        raise CalibratorError(
            f"{run.source} does not end at rest: let the scale log until the reading has stayed the"
            f" same for at least {REST} readings"
        )
    rest = away[len(away) - backwards :]
    # noise within the rests, and what rounding to the scale's steps adds to it
    steps = np.abs(np.diff(run.second))
    digit = float(steps[steps > 0].min()) if np.any(steps > 0) else 0.0
    noise = float(
        np.hypot(max(base.std(), rest.std()), min(digit, abs(change) / 2000) / np.sqrt(12))
    )
    total = float(rest.mean())
    first = max(REST, _last_within(away, TIGHT * noise + 1e-9 * total))
    last = len(away) - max(REST, _last_within(total - away[::-1], TIGHT * noise + 1e-9 * total))
    away = np.concatenate([away[:last], np.full(len(away) - last, total)])
    return _Log(run.first, away, noise, first, last)


def _last_within(away: np.ndarray, limit: float) -> int:
    """How many readings come before the first from which on all lie beyond the limit."""
    beyond = np.flatnonzero(away <= limit)
    return int(beyond[-1]) + 1 if len(beyond) else 0


def _touched(run: Run, log: _Log) -> list[str]:
    """Steps against the flow that are no noise."""
    limit = max(TOUCH * log.mass[-1], 2 * TIGHT * log.noise)
    return [
        f"{run.source} line {run.lines[i + 1]}: the mass steps by {-step * 1e3:.3g} g against the"
        " flow; the scale was touched: repeat the run, or delete the readings that were spoiled"
        for i, step in enumerate(np.diff(log.mass))
        if step < -limit
    ]


def _long_gaps(run: Run, log: _Log) -> list[str]:
    """Gaps within the flow that are too long for its features."""
    inside = slice(log.first - 1, log.last + 1)
    steps = np.diff(log.time[inside])
    whole = log.time[log.last] - log.time[log.first - 1]
    usual = float(np.median(np.diff(log.time)))
    return [
        f"{run.source} line {run.lines[log.first + i]}: no reading for {step:.3g} s of a flow of"
        f" {whole:.3g} s; repeat the run"
        for i, step in enumerate(steps)
        if step > GAP * usual and step > LONG_GAP * whole
    ]


def _release(run: Run, log: _Log, bench: Bench) -> tuple[float, str, list[str]]:
    """When the neck was opened [s], how that is known ("" where it is not), and warnings."""
    onset = float(log.time[log.first - 1])
    falls = run.second[-1] < run.second[0]
    if bench.released is not None:
        if bench.released > log.time[log.first]:
            raise CalibratorError(
                f"{run.source}: the mass changes before the release at {bench.released:g} s; give"
                " --released by the log's own clock"
            )
        return bench.released, "as given", []
    if falls:
        return onset, "the last reading before the vessel's mass falls", []
    if bench.fall_height is not None:
        fall = float(np.sqrt(2 * bench.fall_height / GRAVITY))
        return onset - fall, f"the last reading at rest less a fall of {fall:.3g} s", []
    return (
        onset,
        "",
        [
            "the release is not known: onset, discharge and emptying time are counted from the last"
            " reading at rest and are not written; give --released, or --fall-height"
        ],
    )


def _monotone(mass: np.ndarray) -> np.ndarray:
    """The curve without steps back: halfway between the highest so far and the lowest to come.

    The features ask for a mass that does not decrease; a running maximum alone would lie above the
    noise, a running minimum below it.
    """
    highest = np.maximum.accumulate(mass)
    lowest = np.minimum.accumulate(mass[::-1])[::-1]
    return np.asarray(np.clip((highest + lowest) / 2, 0, mass[-1]))


def _values(
    log: _Log, features: dict[str, float], begin: float, origin: str, bench: Bench
) -> dict[str, Value]:
    """The responses of one log, with the errors that the log itself shows."""
    total, known = float(log.mass[-1]), bool(origin)
    interval = float(np.median(np.diff(log.time)))
    # the release and the end lie anywhere between two readings
    moment = interval / np.sqrt(12) * np.sqrt(2)
    rate, share = features["mass_flow_rate"], log.mass / total
    steady = log.time[(share >= 0.2) & (share <= 0.7)]
    spread = float(np.sqrt(np.sum((steady - steady.mean()) ** 2)))
    scatter = np.hypot(features["rate_fluctuation"] * total, log.noise)
    rate_error = float(scatter / spread)
    quarters = rate_error * np.sqrt(2) * (0.5 / 0.3) ** 1.5  # two lines over 30 % instead of 50 %
    onset_error = float(np.hypot(moment, scatter / rate / np.sqrt(len(steady))))
    values = {
        "drained_mass": Value(total, log.noise, "kg", False),
        "mass_flow_rate": Value(rate, rate_error, "kg/s"),
        "late_early_ratio": Value(features["late_early_ratio"], float(quarters / rate), "1"),
        "rate_fluctuation": Value(features["rate_fluctuation"], log.noise / total, "1"),
        "onset_delay": Value(features["onset_delay"], onset_error, "s", known),
        "discharge_time": Value(float(log.time[log.last] - begin), moment, "s", known),
        "emptying_time": Value(features["emptying_time"], moment, "s", known),
    }
    return {**values, **_residual(total, log.noise, bench)}


def _residual(total: float, noise: float, bench: Bench) -> dict[str, Value]:
    """What stayed behind, where it is known what was filled in."""
    if bench.fill_mass is None:
        return {}
    left = bench.fill_mass - total
    if left < -TIGHT * noise - 1e-3 * bench.fill_mass:
        raise CalibratorError(
            f"more has drained ({total * 1e3:.4g} g) than was filled in"
            f" ({bench.fill_mass * 1e3:.4g} g); correct --fill-mass, or the unit of the log"
        )
    left = max(left, 0.0)
    values = {
        "residual_mass": Value(left, noise, "kg"),
        "residual_fraction": Value(left / bench.fill_mass, noise / bench.fill_mass, "1"),
    }
    size = (bench.bulk_density, bench.cylinder_diameter, bench.neck_diameter)
    density, cylinder, neck = size
    if density is None or cylinder is None or neck is None:
        return values
    if not 0 < neck < cylinder:
        raise CalibratorError("--neck-diameter has to be below --cylinder-diameter; correct them")
    angle = scripts_measure().crater_angle_from_volume(left / density, cylinder / 2, neck / 2)
    return {**values, "drained_equivalent_angle_deg": Value(angle, None, "deg")}


def _doubts(run: Run, log: _Log, features: dict[str, float]) -> list[str]:
    """What can be measured and is hardly good enough."""
    warnings, steps = [], np.diff(log.time)
    flow = log.time[log.last] - log.time[log.first - 1]
    if longest := [s for s in steps[log.first - 1 : log.last] if s > GAP * np.median(steps)]:
        warnings.append(
            f"no reading for {max(longest):.3g} s of a flow of {flow:.3g} s; repeat the run if that"
            " is no habit of the scale"
        )
    if np.median(steps) > flow / 40:
        warnings.append(
            f"a reading every {np.median(steps):.3g} s of a flow of {flow:.3g} s: times are known"
            " to that only; let the scale log more often"
        )
    if log.noise > 0.5 * features["rate_fluctuation"] * log.mass[-1]:
        warnings.append(
            "the fluctuation of the rate is mostly the scale's own noise; do not calibrate on it"
        )
    return warnings


def _notes(run: Run, log: _Log, origin: str, bench: Bench) -> tuple[str, ...]:
    """How it was measured."""
    falls = run.second[-1] < run.second[0]
    what = "the vessel was weighed, its mass falls" if falls else "what flowed out was weighed"
    return (
        f"{len(log.time)} readings, every {np.median(np.diff(log.time)):.3g} s; {what}; noise"
        f" {log.noise * 1e3:.2g} g",
        f"release: {origin or 'not known'}",
    )
