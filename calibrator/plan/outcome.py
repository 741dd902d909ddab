"""What the verbs `plan`, `run` and `collect` found, as values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from calibrator.case.case import Case
from calibrator.case.fingerprint import Fingerprint, fingerprint
from calibrator.runs.folder import RETRIED
from calibrator.runs.record import Record
from calibrator.runs.workspace import Counts, contents


@dataclass(frozen=True)
class SetupForecast:
    """What the runs of an experiment will take; pairs are the smallest and the largest of its runs.

    runs : number; particles : grains; steps : time steps; core_seconds_per_run [s]; core_hours [h]
    of all.
    """

    runs: int
    particles: tuple[int, int]
    steps: tuple[int, int]
    core_seconds_per_run: tuple[float, float]
    core_hours: float


@dataclass(frozen=True)
class Forecast:
    """Outcome of the verb `plan`.

    runs : of the whole plan; finished : of these; core_hours, core_hours_left [h] : predicted for
    all, and for those that are not finished; setups : by name of the set-up, or setup@condition.
    """

    runs: int
    finished: int
    core_hours: float
    core_hours_left: float
    setups: dict[str, SetupForecast]
    fingerprint: Fingerprint

    def lines(self) -> list[str]:
        """The forecast in plain words."""
        said = [
            f"{self.runs} runs, {self.finished} finished; predicted {self.core_hours:.2f}"
            f" core-hours, {self.core_hours_left:.2f} left"
        ]
        for name, s in self.setups.items():
            said.append(
                f"  {name}: {s.runs} runs of {s.particles[0]}-{s.particles[1]} grains, "
                f"{s.steps[0]:,}-{s.steps[1]:,} steps, {s.core_seconds_per_run[0]:.0f}-"
                f"{s.core_seconds_per_run[1]:.0f} core-seconds"
            )
        return said


@dataclass(frozen=True, kw_only=True)
class Collection(Counts):
    """Outcome of the verbs `run` and `collect`: the finished runs of the database.

    Attributes
    ----------
    runs : finished runs; from_shipped_database : those that come with the project; missing : runs
        of the plan that are not finished.
    ended : "failed" where no run of a set-up was good; else how an adaptive design ended,
        "confirmed", "unreachable" or "budget", and empty for other designs; sentence : that in
        words, and what to do; recommended : the set that an adaptive design ended with.
    """

    runs: int
    from_shipped_database: int
    missing: int
    ended: str = ""
    sentence: str = ""
    recommended: dict[str, float] = field(default_factory=dict)
    fingerprint: Fingerprint

    @property
    def passed(self) -> bool:
        """Whether every set-up has a good run."""
        return self.ended != "failed"

    def lines(self) -> list[str]:
        """The collection in plain words."""
        first = f"{self.runs} runs: " + ", ".join(f"{n} {k}" for k, n in self.statuses.items())
        if self.from_shipped_database:
            first += (
                f"; {self.from_shipped_database} of them come with the project (same content), use"
                " --fresh to run them anew"
            )
        if self.missing:
            first += f"; {self.missing} of the plan are still missing"
        said = [first, *(f"  {run_id} {why}" for run_id, why in self.failed.items())]
        if len(self.yade) > 1:
            said.append(
                f"  made by YADE {', '.join(self.yade)}: numbers of different versions may differ;"
                " --fresh makes all runs anew"
            )
        if any(why.startswith(RETRIED) for why in self.failed.values()):
            said.append(
                "  failed runs are not tried again: for that, delete failures.json in the results"
                " folder"
            )
        return said + [f"  {self.sentence}"] * bool(self.sentence)


def rests_on(case: Case, records: Sequence[Record]) -> Fingerprint:
    """Fingerprint of what a plan, and how an adaptive one ended, is computed from.

    What was measured matters to an adaptive design only, which chooses its runs by it.
    """
    problem = case.problem
    chosen_by = {"targets": problem.targets, "interpolation": case.interpolation}
    return fingerprint(
        {
            **(chosen_by if case.plan.design == "adaptive" else {}),
            "parameters": problem.parameters,
            "constraints": problem.constraints,
            "fixed values": problem.fixed,
            "set-ups": {e: problem.values_of(e) for e in problem.experiments},
            "plan": case.plan,
            "runs": contents(records),
            **({"fidelity": case.fidelity} if case.fidelity else {}),
        }
    )
