"""What a calibration found, as a value, and the arrays that it leaves beside the summary.

This module computes nothing and imports no search, so that whoever reads an outcome needs none.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calibrator.case.case import Case
from calibrator.case.fingerprint import Fingerprint, fingerprint
from calibrator.case.problem import UNMENTIONED
from calibrator.errors import CalibratorError
from calibrator.files import read_arrays, read_bytes
from calibrator.plan.run import cheap_records, database_records
from calibrator.runs.record import Record
from calibrator.runs.workspace import Counts, Workspace, contents
from calibrator.search.parts import Candidate, Identifiability, Reachability, Sensitivity
from calibrator.search.two_kinds import TwoKinds

COMPROMISE = "compromise"


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration(Counts):
    """Outcome of the verb `calibrate`; statuses, failed and yade are those of the database's runs.

    Attributes
    ----------
    candidates : by label, "compromise" the recommended one, "individual A", ... along the front.
    compromise_reason : the rule that chose it; front_size : members of the front.
    generational_distance : for each repeat of the search, the mean distance of the front of each
        generation to the last one, in units of the objectives.
    seed_noise : standard deviation of a single run by experiment.response, in the response's unit,
        also of what is held out where the runs measured it; None where too few replicates say.
    replicated : parameter sets with replicates, and all sets.
    leave_one_out_rms : error of the interpolant at sets left out, in the response's unit.
    unseen : which set-ups do not have which parameters, a sentence each; failures : how many runs
        failed, and how many of those nearest to each candidate, likewise.
    fidelity : what full and cheap runs say of each response; empty where there are no cheap ones.
    arrays : hash of calibration.npz beside the summary, which holds the front, the populations and
        the interpolant's state (see `Traces`).
    fingerprint : of all that this was computed from.
    """

    candidates: dict[str, Candidate]
    compromise_reason: str
    front_size: int
    generational_distance: tuple[tuple[float, ...], ...]
    seed_noise: dict[str, float | None]
    replicated: tuple[int, int]
    leave_one_out_rms: dict[str, float | None]
    reachability: Reachability
    identifiability: Identifiability
    sensitivity: Sensitivity
    unseen: tuple[str, ...]
    failures: tuple[str, ...]
    arrays: str
    fingerprint: Fingerprint
    fidelity: tuple[TwoKinds, ...] = dataclasses.field(default=(), metadata=UNMENTIONED)

    @property
    def compromise(self) -> Candidate:
        """The recommended candidate."""
        return self.candidates[COMPROMISE]

    @property
    def ordered(self) -> dict[str, Candidate]:
        """The compromise, then the individuals in order along the front."""
        others = {k: v for k, v in self.candidates.items() if k != COMPROMISE}
        return {COMPROMISE: self.compromise, **others}

    @property
    def outside(self) -> tuple[str, ...]:
        """Parameters of the compromise that their own 95 % interval does not hold."""
        chosen = self.compromise.parameters
        return tuple(
            p.name
            for p in self.identifiability.parameters
            if not p.interval_95[0] <= chosen[p.name] <= p.interval_95[1]
        )

    @property
    def doubts(self) -> tuple[str, ...]:
        """What the numbers cannot be trusted with, in plain words."""
        said = []
        targets = self.compromise.predicted
        if unknown := [key for key in targets if self.seed_noise.get(key) is None]:
            said.append(
                f"the seed noise of {', '.join(unknown)} is not known, as too few sets have"
                " replicates: give plan.replicates = 2 or more"
            )
        elif self.replicated[0] < self.replicated[1] / 2:
            said.append(
                f"the seed noise was measured at {self.replicated[0]} of {self.replicated[1]}"
                " parameter sets only, and may be larger elsewhere: give more of them replicates"
                " (plan.replicated_sets)"
            )
        if self.identifiability.refused:
            where = " though within their tolerances" if self.reachability.all else ""
            said.append(
                "no parameter set agrees with all targets within the errors of the measurements"
                f"{where and ',' + where} (chi2 = {self.identifiability.chi2:.3g} at the best one)"
            )
        return tuple(said)

    def lines(self) -> list[str]:
        """The outcome in plain words, the answer first."""
        chosen = self.compromise.parameters
        values = ", ".join(f"{k} = {v:.4g}" for k, v in chosen.items())
        first = f"front of {self.front_size}; compromise: {values} ({self.compromise_reason})"
        cheap = (kinds.sentence for kinds in self.fidelity)
        sentences = (*self.unseen, *self.failures, *cheap, *self.reachability.sentences)
        said = [first, *(f"  {sentence}" for sentence in sentences)]
        said += [f"  {doubt}" for doubt in self.doubts]
        for p in self.identifiability.parameters:
            truth = ""
            if p.truth is not None:
                truth = f"; the truth is {p.truth:.4g}, the compromise {chosen[p.name]:.4g}"
            said.append(f"  {p.sentence}{truth}")
        return said


@dataclass(frozen=True, eq=False)
class Traces:
    """The arrays of a calibration, kept in calibration.npz.

    Attributes
    ----------
    points (p, d), objectives (p, k) : the Pareto front, sorted by the first objective.
    snapshots : generation -> objectives (n, k) of the whole population, 0 the random one.
    kernels (m, q), noise (m,) : what the interpolant learnt (see `interpolant.Learnt`).
    """

    points: np.ndarray
    objectives: np.ndarray
    snapshots: dict[int, np.ndarray]
    kernels: np.ndarray
    noise: np.ndarray

    def named(self) -> dict[str, np.ndarray]:
        """The arrays by their names in the file."""
        generations = {f"generation_{g}": found for g, found in self.snapshots.items()}
        plain = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return {name: a for name, a in plain.items() if name != "snapshots"} | generations


def arrays_path(space: Workspace) -> Path:
    """Where a calibration keeps its arrays."""
    return space.path / "calibration.npz"


def hash_of(raw: bytes) -> str:
    """Short hash of a file's bytes."""
    return hashlib.sha256(raw).hexdigest()[:16]


def read_traces(space: Workspace, calibration: Calibration) -> Traces:
    """The arrays that a calibration left.

    Raises CalibratorError, with the command to run, where they are missing or not its own.
    """
    path = arrays_path(space)
    try:
        if hash_of(read_bytes(path, links=False)) != calibration.arrays:
            raise ValueError("they belong to another calibration")
        found = read_arrays(path)
    except (OSError, ValueError) as error:
        raise CalibratorError(
            f"cannot use {path} ({error}): run `{space.command('calibrate')}` again"
        ) from None
    snapshots = {
        int(name.removeprefix("generation_")): array
        for name, array in found.items()
        if name.startswith("generation_")
    }
    own = ("points", "objectives", "kernels", "noise")
    return Traces(**{name: found[name] for name in own}, snapshots=snapshots)


def rests_on(case: Case, records: Sequence[Record]) -> Fingerprint:
    """Fingerprint of all that a calibration is computed from."""
    problem = case.problem
    return fingerprint(
        {
            "targets": problem.targets,
            "parameters": problem.parameters,
            "constraints": problem.constraints,
            "fixed values": problem.fixed,
            "set-ups": {e: problem.values_of(e) for e in problem.experiments},
            "interpolation": case.interpolation,
            "plan": case.plan,
            "search settings": case.search,
            "verify.replicates": case.verify.replicates,
            "truth": case.truth,
            "runs": contents(records),
            **({"fidelity": case.fidelity} if case.fidelity else {}),
        }
    )


def current_calibration(space: Workspace, records: Sequence[Record] | None = None) -> Calibration:
    """The calibration, if the case and the database are still those that it was made from.

    records : the database's, where the caller has them.
    Raises CalibratorError, with the command to run, where there is none or it is stale.
    """
    known = database_records(space) if records is None else records
    now = rests_on(space.case, [*known, *cheap_records(space)])
    return space.current("calibrate", Calibration, now)
