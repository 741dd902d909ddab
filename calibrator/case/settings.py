"""The tables of a case file as values, each of which refuses what cannot be meant.

Plan, interpolation, search, replicates, running, cluster and diagnosis.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from calibrator.case.values import is_number, known
from calibrator.case.vocabulary import EFFECTS
from calibrator.errors import CalibratorError, Mistakes, shown

MOST_RUNS = 1_000_000  # of a plan; a slip of the pen is refused before it fills the memory
MOST_SETS = 1000  # of a diagnosis
ADAPTIVE_REPLICATED = 2  # sets of an adaptive design's start: enough to pool the seed noise from
MOST_EVALUATIONS = 10**9  # of a search, likewise


@dataclass(frozen=True)
class Plan:
    """The design of the database: full grid or Sobol sequence, replicates per set, first seed.

    replicated_sets bounds how many sets, the cheapest to simulate, get their replicates; the others
    are run once. 0: all. design = "adaptive" starts with `sets` of the Sobol sequence, two of them
    replicated (unless replicated_sets says otherwise), and then chooses each run by what the
    earlier ones say, until `replicates` runs at one set meet every target or `most_runs` are made,
    of all set-ups, the failed ones and those of a shipped database counted (see `adaptive`).
    """

    design: str = "sobol"
    sets: int = 24
    replicates: int = 2
    replicated_sets: int = 0
    most_runs: int = 100
    seed: int = 1000

    def __post_init__(self) -> None:
        mistakes = Mistakes()
        with mistakes.noted():
            known(self.design, ("grid", "sobol", "adaptive"), "plan.design")
        with mistakes.noted():
            require_within(
                "plan",
                self,
                sets=(1, MOST_RUNS),
                replicates=(1, MOST_RUNS),
                replicated_sets=(0, MOST_RUNS),
                most_runs=(1, MOST_RUNS),
                # above it, those of substitutes and of the adaptive design would meet the plan's
                seed=(0, 30_000_000),
            )
        mistakes.raise_any()

    def adaptive_start(self, experiments: int) -> int:
        """Runs of so many experiments that an adaptive design makes before it can choose any."""
        replicated = min(self.replicated_sets or ADAPTIVE_REPLICATED, self.sets)
        return experiments * (self.sets + replicated * (self.replicates - 1))


@dataclass(frozen=True)
class Interpolation:
    """How raw responses are interpolated: multilinear on a grid, or a Gaussian process.

    similarity takes the particle density out of the parameter space: only E / rho_p matters (see
    `coordinates`).
    """

    method: str = "process"
    similarity: bool = False

    def __post_init__(self) -> None:
        known(self.method, ("process", "multilinear"), "interpolation.method")


@dataclass(frozen=True)
class Search:
    """Settings of the genetic algorithm; the defaults are the reference paper's (Table 4)."""

    objectives: tuple[str, ...] = ("error", "time_cost")
    population: int = 5000
    generations: int = 100
    crossover: float = 0.9
    mutation: float = 0.01
    seed: int = 1
    repeats: int = 3

    def __post_init__(self) -> None:
        require_within(
            "search",
            self,
            population=(4, 10**6),
            generations=(1, 10**6),
            repeats=(1, 1000),
            seed=(0, 10**9),
            crossover=(0, 1),
            mutation=(0, 1),
        )
        if self.population * self.generations * self.repeats > MOST_EVALUATIONS:
            raise CalibratorError(
                f"search: population x generations x repeats is more than {MOST_EVALUATIONS:,},"
                " which would take days: lower one"
            )
        if len(self.objectives) < 1:
            raise CalibratorError(
                "search.objectives is empty: name at least one objective, such as error"
            )
        if len(set(self.objectives)) < len(self.objectives):
            raise CalibratorError("search.objectives names one twice: keep one of them")


@dataclass(frozen=True)
class Replicates:
    """Fresh seeds for verification or validation.

    replicates : for the compromise; spread_replicates : for each spread individual; seed : the
    first one; most_failed : share of a set-up's runs beyond which a candidate is no recommendation
    whatever the others give, as it would fail its user as often. shipped names a database of such
    runs, for a published verification that others follow without simulating; runs that it lacks are
    made, and `--fresh` ignores it. The calibration itself never sees these runs.
    """

    replicates: int = 5
    seed: int = 500_000
    spread_replicates: int = 2
    most_failed: float = 0.5
    shipped: str = ""

    def __post_init__(self) -> None:
        require_within("verify/validate", self, most_failed=(0, 1))
        require_within(
            "verify/validate",
            self,
            replicates=(1, 10_000),
            seed=(0, 2 * 10**9),
            spread_replicates=(0, 10_000),
        )


@dataclass(frozen=True)
class Validation(Replicates):
    """Fresh seeds for validation, which are none of the verification's; see `Replicates`."""

    replicates: int = 3
    seed: int = 600_000
    spread_replicates: int = 0


PARTICLE_STEPS_PER_SECOND = 2.12e6
"""Of a core with up to a thousand grains, until runs say better: that of one machine."""


@dataclass(frozen=True)
class Running:
    """How runs are carried out.

    jobs : at a time, 0 takes every core it is allowed; attempts : at a run that fails, or takes ten
    times its predicted CPU time; budget_core_hours [h] : what one command may spend, asked before
    each batch of runs; shipped : a database to start from; yade : the build of YADE, as a name on
    the PATH or an absolute path, whose own yade-batch is called as it with "-batch" behind. A case
    may come from anybody: what it names must be called yade-something. particle_steps_per_second :
    of a core with up to a thousand grains, what a forecast starts from.
    """

    jobs: int = 0
    attempts: int = 2
    budget_core_hours: float = 24.0
    shipped: str = ""
    yade: str = ""
    particle_steps_per_second: float = PARTICLE_STEPS_PER_SECOND

    def __post_init__(self) -> None:
        _matches(
            "run.yade",
            self.yade,
            r"(/[A-Za-z0-9_.+-]+)*/?yade[A-Za-z0-9_.+-]*",
            "a name such as yadedaily, or an absolute path such as /opt/yade/bin/yade-trunk",
        )
        require_within(
            "run",
            self,
            jobs=(0, 10_000),
            attempts=(1, 100),
            budget_core_hours=(0, 1e12),
            particle_steps_per_second=(1e3, 1e9),
        )


@dataclass(frozen=True)
class Cluster:
    """What SLURM is asked for (see docs/cluster.md); what is left empty is up to the site.

    time and memory are those of one array task. modules are names for `module load`; shell are
    lines that are run as they stand before the work, which only a site file may give. slice_minutes
    is the predicted work of a task, most_tasks how many are submitted at a time, grace the seconds
    that a shared file system may take to show a record. Raises CalibratorError for a value that
    SLURM would not take.
    """

    partition: str = ""
    account: str = ""
    time: str = ""
    memory: str = ""
    modules: tuple[str, ...] = ()
    shell: tuple[str, ...] = ()
    slice_minutes: float = 30.0
    most_tasks: int = 1001
    grace: float = 60.0

    def __post_init__(self) -> None:
        _matches(
            "cluster.partition",
            self.partition,
            r"[A-Za-z0-9_][A-Za-z0-9_.,-]*",
            "a name such as main",
        )
        _matches(
            "cluster.account",
            self.account,
            r"[A-Za-z0-9_][A-Za-z0-9_.-]*",
            "a name such as physics",
        )
        _matches(
            "cluster.time",
            self.time,
            r"(\d+-)?\d{1,4}:\d\d(:\d\d)?|\d{1,6}",
            "minutes, or a time such as 02:00:00",
        )
        _matches("cluster.memory", self.memory, r"\d{1,9}[KMGT]?", "a size such as 2G")
        for module in self.modules:
            _matches(
                "cluster.modules",
                module,
                r"[A-Za-z0-9_][A-Za-z0-9_.+/-]*",
                "names such as yade/2023.02",
            )
        require_within(
            "cluster", self, slice_minutes=(0, 1e6), most_tasks=(1, MOST_RUNS), grace=(0, 1e6)
        )


def _matches(where: str, value: str, pattern: str, example: str) -> None:
    """Raise CalibratorError, with an example, unless a value is empty or of the pattern."""
    if value and not re.fullmatch(pattern, value, re.ASCII):
        raise CalibratorError(f"{where} = {shown(value)}: give {example}")


@dataclass(frozen=True)
class Diagnosis:
    """Runs that the search for a missing effect is made from, in each experiment.

    sets with replicates of the model as it is, the same sets once more with other seeds as baseline
    of the fingerprints, and effect_sets of each effect at different amplitudes.

    effects : columns of the library, all unless given. scales : plausible sizes by column, in its
    unit, where they are not the library's: drag matters to fine sand, not to coarse; a negative one
    looks below the column's default only. nuisances : table of the metrology's errors. day_error :
    of what the replicates of a day share, over the scatter of one replicate; 0 where they share
    nothing.
    verify_replicates : fresh seeds of the model before and after. budget_core_hours : more than
    that is not spent without --yes.
    """

    effects: tuple[str, ...] = tuple(EFFECTS)
    sets: int = 16
    replicates: int = 2
    effect_sets: int = 8
    verify_replicates: int = 5
    seed: int = 700_000
    nuisances: str = ""
    day_error: float = 1.0
    shipped: str = ""
    budget_core_hours: float = 2.0
    scales: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.effects:
            known(name, EFFECTS, "effect in diagnosis.effects")
        for name, size in self.scales.items():
            known(name, self.effects, "effect in diagnosis.scales")
            column = EFFECTS[name]
            assert (
                column.low is not None
                and column.high is not None
                and isinstance(column.default, (int, float))
            )
            least, largest = column.low - column.default, column.high - column.default
            if size == 0 or not least <= size <= largest:
                below = (
                    f", or at least {least:g} to look below the default only" if least < 0 else ""
                )
                raise CalibratorError(
                    f"diagnosis.scales.{name} = {size:g}: give a size above 0 and at most"
                    f" {largest:g}{below}"
                )
        if len(set(self.effects)) < len(self.effects) or not self.effects:
            raise CalibratorError(
                "diagnosis.effects is empty or names one twice: name each effect once"
            )
        require_within(
            "diagnosis",
            self,
            sets=(4, MOST_SETS),
            replicates=(1, 99),
            effect_sets=(4, 1000),
            verify_replicates=(2, 99),
            day_error=(0, 100),
            # above it, those of fingerprints and confirming runs would be more than YADE takes
            seed=(0, 1_500_000_000),
            budget_core_hours=(0, 1e12),
        )


def require_within(section: str, settings: Any, **bounds: tuple[float, float]) -> None:
    """Raise CalibratorError for all of these numbers that lie outside their bounds.

    section : of the case file, for the message; bounds : the smallest and the largest value of each
    attribute of the settings.
    """
    mistakes = Mistakes()
    for name, (low, high) in bounds.items():
        value = getattr(settings, name)
        if not is_number(value) or value < low:
            mistakes.note([f"{section}.{name} = {shown(value)}: give {low} or more"])
        elif value > high:
            mistakes.note([f"{section}.{name} = {shown(value)}: give {high:g} or less"])
    mistakes.raise_any()
