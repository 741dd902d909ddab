"""What a report draws on: the outcomes of the verbs, the runs, and what is computed from them anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calibrator.errors import CalibratorError
from calibrator.files import read_arrays
from calibrator.plan.run import database_records
from calibrator.report.html import paragraph
from calibrator.report.words import text
from calibrator.responses.fit import fit
from calibrator.responses.interpolant import Interpolant
from calibrator.runs.record import Record
from calibrator.runs.workspace import Workspace, for_new_seeds
from calibrator.search.calibrate import search_fronts
from calibrator.search.nsga2 import SearchResult
from calibrator.verification.verify import validation_requests, verification_requests

STALE = 1e-6  # relative difference of a prediction that rounding cannot explain


@dataclass(frozen=True, eq=False)
class Findings:
    """All that the sections draw on: the workspace, its summary, the runs of the plan, and what is
    computed from them.
    """

    space: Workspace
    summary: dict[str, Any]
    records: list[Record]
    verified: dict[str, list[Record]]
    validated: dict[str, list[Record]]
    interpolant: Interpolant
    fronts: list[SearchResult]

    @classmethod
    def of(cls, space: Workspace) -> Findings:
        """Gather the runs and repeat interpolation and search."""
        space.outcome("calibrate")
        case = space.case
        records = database_records(space)
        interpolant = fit(case, records)
        return cls(
            space,
            space.summary(),
            records,
            {
                k: for_new_seeds(space, case.verify).finished(own)
                for k, own in verification_requests(space).items()
            },
            {
                k: for_new_seeds(space, case.validate).finished(own)
                for k, own in validation_requests(space).items()
            },
            interpolant,
            search_fronts(case, interpolant),
        )

    @property
    def calibration(self) -> dict[str, Any]:
        """Outcome of the verb calibrate."""
        return self.summary["calibrate"]

    @property
    def candidates(self) -> dict[str, dict[str, Any]]:
        """The compromise, then the individuals in order along the front."""
        found = self.calibration["candidates"]
        return {
            "compromise": found["compromise"],
            **{k: v for k, v in found.items() if k != "compromise"},
        }

    @property
    def compromise(self) -> np.ndarray:
        """Parameter set (d,) of the compromise."""
        chosen = self.candidates["compromise"]["parameters"]
        return np.array([chosen[name] for name in self.space.case.problem.names])

    @property
    def stale(self) -> bool:
        """Whether the database has changed since `calibrate` wrote its predictions."""
        stored = [
            self.candidates["compromise"]["predicted"][key]["mean"]
            for key in self.interpolant.responses
        ]
        return not np.allclose(
            self.interpolant.predict(self.compromise[None])[0], stored, rtol=STALE, atol=0
        )

    def outcome(self, verb: str) -> dict[str, Any] | None:
        """Outcome of verify (of the compromise) or validate;

        None where its runs are not those of the present compromise.
        """
        found = self.summary.get(verb)
        runs = (self.validated if verb == "validate" else self.verified).get("compromise", [])
        counts = (
            {}
            if found is None
            else found["candidates"]["compromise"]
            if verb == "verify"
            else found
        )
        return found if found and sum(counts["statuses"].values()) == len(runs) > 0 else None

    def command(self, verb: str) -> str:
        """The command that does a step, as HTML."""
        return f"<code>{text(f'calibrator {verb} {self.space.case.path}')}</code>"


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
        point = np.array([record.request.value(n) for n in problem.names], float)
        return float(np.linalg.norm((point - findings.compromise) / (problem.high - problem.low)))

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
    path = findings.space.runs.curves(record.run_id)
    try:
        return _checked_curves(read_arrays(path))
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise CalibratorError(
            f"{path} is damaged ({error}): delete it and its record, then run the verbs again"
        ) from None
