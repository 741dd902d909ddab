"""Which parameter set is handed on, and how far it was verified."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path

from calibrator.case.fingerprint import changed
from calibrator.case.values import Value, known
from calibrator.case.vocabulary import EFFECTS, PARAMETERS
from calibrator.plan.requests import make_request
from calibrator.plan.run import with_curves
from calibrator.runs.workspace import Workspace, for_new_seeds
from calibrator.search.outcome import COMPROMISE, Calibration, current_calibration
from calibrator.verification.outcome import Verdict, Verification
from calibrator.verification.verify import verification_requests, verification_rests_on

CONTACT = (
    "particle_radius",
    "particle_density",
    "young_modulus",
    "poisson_ratio",
    "restitution",
    "sliding_friction",
    "rolling_friction",
    "rolling_spring",
    "rolling_stiffness_ratio",
)
"""What a contact is made of in every engine; effects come on top."""

STEP = ("rayleigh_fraction", "time_step")
SWITCHES = (*EFFECTS, "shaking", "size_distribution")
"""Columns that are off at their default: the effects, a set-up's vibration, and given sizes."""


@dataclass(frozen=True)
class Standing:
    """How far a candidate was verified.

    Attributes
    ----------
    passed : whether fresh runs met every target; None where there are none, or none that count.
    sentence : the same in words, with what is to be done where it is not so.
    """

    passed: bool | None
    sentence: str

    def here(self, space: Workspace) -> str:
        """The sentence with the command as it is called on this machine."""
        return self.sentence.replace(shared(space, "verify"), space.command("verify"))


@dataclass(frozen=True)
class Chosen:
    """A candidate of a calibration as it is handed on.

    Attributes
    ----------
    case, about, label : name and purpose of the case, and the candidate's label.
    values : the contact's parameters, those of the step, and all effects, by name, in their units.
    calibrated : names of those that were calibrated; the others were fixed, or are defaults.
    setups : set-ups of the calibration; differing : parameters of the contact that these set-ups do
        not share, whose value is then that of the first.
    yade : versions of YADE that made the runs; command : the one that makes the calibration anew.
    """

    case: str
    about: str
    label: str
    values: dict[str, Value]
    calibrated: tuple[str, ...]
    setups: tuple[str, ...]
    differing: tuple[str, ...]
    standing: Standing
    yade: tuple[str, ...]
    command: str

    @property
    def numbers(self) -> dict[str, float]:
        """The values that are numbers."""
        return {n: float(v) for n, v in self.values.items() if not isinstance(v, str)}

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that are on, the set-up's own among them."""
        return tuple(n for n in SWITCHES if self.values[n] != PARAMETERS[n].default)

    @property
    def stem(self) -> str:
        """Start of the files' names, which Python can import."""
        words = self.case if self.label == COMPROMISE else f"{self.case}_{self.label}"
        stem = re.sub(r"\W", "_", words, flags=re.ASCII)
        return f"_{stem}" if stem[0].isdigit() else stem


def chosen(space: Workspace, candidate: str = "") -> Chosen:
    """A candidate of the calibration, the compromise unless another is named.

    candidate : its label, or what is behind "individual" in it.

    Raises
    ------
    CalibratorError, with the command to run, where there is no calibration or it is stale; with the
    labels that there are where it has no such candidate.
    """
    space = with_curves(space)
    found, case = current_calibration(space), space.case
    label = label_of(found, candidate)
    point = found.candidates[label].point(case.problem.names)
    requests = [make_request(case, s, point, 1) for s in case.problem.experiments]
    first = requests[0]
    names = (*CONTACT, *STEP, *SWITCHES)
    return Chosen(
        case=case.name,
        about=case.about,
        label=label,
        values={n: first.value(n) for n in names},
        calibrated=tuple(n for n in case.problem.names if n in names),
        setups=tuple(case.problem.experiments),
        differing=tuple(n for n in names if len({r.value(n) for r in requests}) > 1),
        standing=standing(space, found, label),
        yade=found.yade,
        command=shared(space, "all"),
    )


def shared(space: Workspace, verb: str) -> str:
    """The command of a verb as a file says it that is handed on: without this machine's folders."""
    path = space.case.path
    plain = dataclasses.replace(space, arguments=())
    return plain.command(verb, Path(path.name) if path.is_absolute() else path)


def label_of(calibration: Calibration, candidate: str) -> str:
    """Label of the candidate that a user names; CalibratorError where there is none."""
    labels = list(calibration.ordered)
    if f"individual {candidate}" in labels:
        return f"individual {candidate}"
    return known(candidate or COMPROMISE, labels, "candidate")


def verdict_of(space: Workspace, calibration: Calibration, label: str) -> Verdict | str:
    """The verification's verdict on a candidate; where none counts, why and what to do."""
    noted, verify = space.outcome("verify", Verification), f"`{shared(space, 'verify')}`"
    if noted is None:
        return f"it is a promise of the interpolant so far: run {verify}"
    afresh = for_new_seeds(space, space.case.verify)
    requests = verification_requests(space, calibration)
    done = {name: afresh.finished(own) for name, own in requests.items()}
    parts = changed(noted.fingerprint, verification_rests_on(space, calibration, done))
    if parts:
        return f"{' and '.join(parts)} changed since it was verified: run {verify} again"
    if label not in noted.candidates:
        return f"no fresh run was made of it: raise verify.spread_replicates, and run {verify}"
    return noted.candidates[label]


def standing(space: Workspace, calibration: Calibration, label: str) -> Standing:
    """How far a candidate was verified."""
    verdict = verdict_of(space, calibration, label)
    if isinstance(verdict, str):
        return Standing(None, f"NOT VERIFIED: {verdict}")
    runs = f"{verdict.good} of {verdict.total} fresh YADE runs were good"
    if verdict.passed:
        return Standing(True, f"verified: the mean of fresh YADE runs meets every target; {runs}")
    why = f"they miss {', '.join(verdict.missed)}" if verdict.missed else "too many failed"
    return Standing(False, f"NOT VERIFIED: fresh YADE runs do not confirm it, {why}; {runs}")
