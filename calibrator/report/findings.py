"""What a report draws on: the outcomes of the verbs, and the runs behind them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.case.fingerprint import Fingerprint
from calibrator.case.problem import Target
from calibrator.case.settings import Replicates
from calibrator.plan.outcome import Collection
from calibrator.plan.outcome import rests_on as plan_rests_on
from calibrator.plan.run import all_records, cheap_records, database_records, with_curves
from calibrator.report.html import paragraph
from calibrator.report.words import key_words, text
from calibrator.responses.fit import fit
from calibrator.responses.interpolant import Interpolant, Learnt
from calibrator.responses.table import points_of
from calibrator.runs.curves import arrays_of as read_run
from calibrator.runs.record import Record
from calibrator.runs.workspace import Outcome, Workspace, for_new_seeds
from calibrator.search.outcome import Calibration, Traces, current_calibration, read_traces
from calibrator.search.parts import Candidate, TargetReach
from calibrator.verification.outcome import Validation, Verification
from calibrator.verification.verify import (
    Requests,
    validation_requests,
    validation_rests_on,
    verification_requests,
    verification_rests_on,
    with_held_out_curves,
)


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the sections draw on: what the verbs noted, and the runs behind it.

    Attributes
    ----------
    records, cheap : the database's full runs, and the cheap ones of a case with [fidelity]
    verified, validated : fresh runs by candidate
    interpolant : as the calibration learnt it
    traces : the front and the populations
    collection, verification, validation : None where the verb has not been called
    """

    space: Workspace
    calibration: Calibration
    traces: Traces
    interpolant: Interpolant
    records: list[Record]
    cheap: list[Record]
    collection: Collection | None
    verification: Verification | None
    validation: Validation | None
    verified: dict[str, list[Record]]
    validated: dict[str, list[Record]]

    @classmethod
    def of(cls, space: Workspace) -> Findings:
        """Read what the verbs noted.

        Raises CalibratorError, with the command to run, where the calibration is missing or where
        any outcome rests on something that has changed since.
        """
        space = with_curves(space)
        case, records, cheap = space.case, database_records(space), cheap_records(space)
        calibration = current_calibration(space, records)
        traces = read_traces(space, calibration)
        verified = _done(space, case.verify, verification_requests(space, calibration))
        validated = _done(space, case.validate, validation_requests(space, calibration))
        space, validated = with_held_out_curves(space, validated)
        return cls(
            space,
            calibration,
            traces,
            fit(case, records, Learnt(traces.kernels, traces.noise), cheap),
            records,
            cheap,
            _noted(space, "run", Collection, plan_rests_on(case, all_records(space))),
            _noted(
                space,
                "verify",
                Verification,
                verification_rests_on(space, calibration, verified),
            ),
            _noted(
                space,
                "validate",
                Validation,
                validation_rests_on(space, calibration, validated),
            ),
            verified,
            validated,
        )

    @property
    def candidates(self) -> dict[str, Candidate]:
        """The compromise, then the individuals in order along the front."""
        return self.calibration.ordered

    @property
    def compromise(self) -> np.ndarray:
        """Parameter set (d,) of the compromise."""
        return self.calibration.compromise.point(self.space.case.problem.names)

    def reach_of(self, target: Target) -> TargetReach | None:
        """Which values the box reaches; None for a target that is reported only."""
        found = {reach.key: reach for reach in self.calibration.reachability.targets}
        return found.get(target.key)

    def in_words(self, sentence: str) -> str:
        """A sentence of an outcome with the targets' keys in words."""
        for target in self.space.case.problem.targets:
            sentence = sentence.replace(target.key, key_words(target.key))
        return sentence

    def command(self, verb: str) -> str:
        """The command that does a step, as HTML."""
        return f"<code>{text(self.space.command(verb))}</code>"


def _done(space: Workspace, settings: Replicates, requests: Requests) -> dict[str, list[Record]]:
    """The finished fresh runs by candidate."""
    afresh = for_new_seeds(space, settings)
    return {label: afresh.finished(own) for label, own in requests.items()}


def _noted(space: Workspace, verb: str, cls: type[Outcome], now: Fingerprint) -> Outcome | None:
    """The outcome of a verb that need not have been called."""
    return None if space.outcome(verb, cls) is None else space.current(verb, cls, now)


def missing(findings: Findings, what: str, verb: str) -> str:
    """A paragraph that names the command for what is not there yet."""
    return paragraph(
        f"{text(what)} is missing: run {findings.command(verb)}, then"
        f" {findings.command('report')}.",
        "missing",
    )


def by_distance(findings: Findings, records: Sequence[Record]) -> list[Record]:
    """The records, the nearest to the compromise first."""
    problem = findings.space.case.problem

    def distance(record: Record) -> float:
        point = points_of(problem, [record.request])
        away = problem.shares_of(point) - problem.shares_of(findings.compromise[None])
        return float(np.linalg.norm(np.nan_to_num(away)))

    return sorted(records, key=distance)


def _checked_curves(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays, if they have the shapes that the figures need; else ValueError."""
    for name in {"filled", "final"} & set(arrays):
        if (
            arrays[name].ndim != 2
            or arrays[name].shape[1] != 3
            or not np.isfinite(arrays[name]).all()
        ):
            raise ValueError(f"{name} is not a list of grain centres")
    if "filled" in arrays and not len(arrays["filled"]):
        raise ValueError("filled holds no grain")
    for across, up in (
        ("time", "passed_mass"),
        ("profile_x", "profile_height"),
        ("profile_radius", "profile_height"),
    ):
        if across in arrays and (
            arrays[across].ndim != 1 or up not in arrays or arrays[up].shape != arrays[across].shape
        ):
            raise ValueError(f"{across} and {up} are not the two columns of a curve")
    return arrays


def arrays_of(findings: Findings, record: Record) -> dict[str, np.ndarray]:
    """Arrays of a run; empty where it left none (shipped runs do not come with theirs)."""
    return read_run(findings.space.runs, record, _checked_curves)
