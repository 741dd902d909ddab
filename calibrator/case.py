"""The case file: one TOML per calibration, unknown keys refused, checked before anything runs."""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from calibrator.errors import CalibratorError, shown
from calibrator.files import named_file, read_text
from calibrator.lab import Nuisance, Observable, read_lab, read_nuisances
from calibrator.problem import Parameter, Problem, Target, Value, checked_value, is_number, known
from calibrator.quantities import EFFECTS, PARAMETERS, SETUPS, parameters_of

MOST_RUNS = 1_000_000  # of a plan; a slip of the pen is refused before it fills the memory
MOST_EVALUATIONS = 10**9  # of a search, likewise


@dataclass(frozen=True)
class Plan:
    """The design of the database: full grid or Sobol sequence, replicates per set, first seed.

    replicated_sets bounds how many sets, the cheapest to simulate, get their replicates; the others are run once. 0: all.
    design = "adaptive" starts with `sets` of the Sobol sequence, two of them replicated (unless replicated_sets says
    otherwise), and then chooses each run by what the earlier ones say, until `replicates` runs at one set meet every target
    or `most_runs` are made (see `adaptive`).
    """

    design: str = "sobol"
    sets: int = 24
    replicates: int = 2
    replicated_sets: int = 0
    most_runs: int = 100
    seed: int = 1000

    def __post_init__(self) -> None:
        known(self.design, ("grid", "sobol", "adaptive"), "plan.design")
        _within("plan", self, sets=(1, MOST_RUNS), replicates=(1, MOST_RUNS), replicated_sets=(0, MOST_RUNS))
        # Above the largest seed, those of substitutes and of the adaptive design would meet those of the plan.
        _within("plan", self, most_runs=(1, MOST_RUNS), seed=(0, 30_000_000))


@dataclass(frozen=True)
class Interpolation:
    """How raw responses are interpolated: multilinear on a grid, or a Gaussian process.

    similarity takes the particle density out of the parameter space: only E / rho_p matters (see `coordinates`).
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
        _within("search", self, population=(4, 10**6), generations=(1, 10**6), repeats=(1, 1000), seed=(0, 10**9))
        _within("search", self, crossover=(0, 1), mutation=(0, 1))
        if self.population * self.generations * self.repeats > MOST_EVALUATIONS:
            raise CalibratorError(
                f"search: population x generations x repeats is more than {MOST_EVALUATIONS:,}, which would take days: lower one"
            )
        if len(self.objectives) < 1:
            raise CalibratorError("search.objectives is empty: name at least one objective, such as error")
        if len(set(self.objectives)) < len(self.objectives):
            raise CalibratorError("search.objectives names one twice: keep one of them")


@dataclass(frozen=True)
class Replicates:
    """Fresh seeds for verification or validation: how many for the compromise and for each spread individual, and the first.

    shipped names a database of such runs, for a published verification that others follow without simulating; runs that it
    lacks are made, and `--fresh` ignores it. The calibration itself never sees these runs.
    """

    replicates: int = 5
    seed: int = 500_000
    spread_replicates: int = 2
    shipped: str = ""

    def __post_init__(self) -> None:
        _within("verify/validate", self, replicates=(1, 10_000), seed=(0, 2 * 10**9), spread_replicates=(0, 10_000))


@dataclass(frozen=True)
class Running:
    """How runs are carried out. jobs = 0 takes every core it is allowed; budget_core_hours stops a plan that is too large."""

    jobs: int = 0
    attempts: int = 2
    budget_core_hours: float = 24.0
    shipped: str = ""

    def __post_init__(self) -> None:
        _within("run", self, jobs=(0, 10_000), attempts=(1, 100), budget_core_hours=(0, 1e12))


@dataclass(frozen=True)
class Cluster:
    """What SLURM is asked for; what is left empty is up to the site. See docs/cluster.md.

    time and memory are those of one array task. modules are names for `module load`; shell are lines that are run as they
    stand before the work, which only a site file may give. slice_minutes is the predicted work of a task, most_tasks how many
    are submitted at a time, grace the seconds that a shared file system may take to show a record.
    Raises CalibratorError for a value that SLURM would not take.
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
        _matches("cluster.partition", self.partition, r"[A-Za-z0-9_][A-Za-z0-9_.,-]*", "a name such as main")
        _matches("cluster.account", self.account, r"[A-Za-z0-9_][A-Za-z0-9_.-]*", "a name such as physics")
        _matches("cluster.time", self.time, r"(\d+-)?\d{1,4}:\d\d(:\d\d)?|\d{1,6}", "minutes, or a time such as 02:00:00")
        _matches("cluster.memory", self.memory, r"\d{1,9}[KMGT]?", "a size such as 2G")
        for module in self.modules:
            _matches("cluster.modules", module, r"[A-Za-z0-9_][A-Za-z0-9_.+/-]*", "names such as yade/2023.02")
        _within("cluster", self, slice_minutes=(0, 1e6), most_tasks=(1, MOST_RUNS), grace=(0, 1e6))


def _matches(where: str, value: str, pattern: str, example: str) -> None:
    if value and not re.fullmatch(pattern, value, re.ASCII):
        raise CalibratorError(f"{where} = {shown(value)}: give {example}")


@dataclass(frozen=True)
class Condition:
    """A variant of a set-up that was measured as well, such as a wider neck: values that differ from the set-up's own."""

    setup: str
    values: dict[str, Value]


@dataclass(frozen=True)
class Diagnosis:
    """Runs that the search for a missing effect is made from, in each experiment.

    sets with replicates of the model as it is, the same sets once more with other seeds as baseline of the fingerprints, and
    effect_sets of each effect at different amplitudes. effects : columns of the library, all unless given. scales : plausible
    sizes by column, in its unit, where they are not the library's: drag matters to fine sand, not to coarse; a negative one
    looks below the column's default only. nuisances : table of the metrology's errors. verify_replicates : fresh seeds of the
    model before and after. budget_core_hours : more than that is not spent without --yes.
    """

    effects: tuple[str, ...] = tuple(EFFECTS)
    sets: int = 16
    replicates: int = 2
    effect_sets: int = 8
    verify_replicates: int = 5
    seed: int = 700_000
    nuisances: str = ""
    shipped: str = ""
    budget_core_hours: float = 2.0
    scales: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.effects:
            known(name, EFFECTS, "effect in diagnosis.effects")
        for name, size in self.scales.items():
            known(name, self.effects, "effect in diagnosis.scales")
            column = EFFECTS[name]
            assert column.low is not None and column.high is not None and isinstance(column.default, (int, float))
            least, largest = column.low - column.default, column.high - column.default
            if size == 0 or not least <= size <= largest:
                below = f", or at least {least:g} to look below the default only" if least < 0 else ""
                raise CalibratorError(f"diagnosis.scales.{name} = {size:g}: give a size above 0 and at most {largest:g}{below}")
        if len(set(self.effects)) < len(self.effects) or not self.effects:
            raise CalibratorError("diagnosis.effects is empty or names one twice: name each effect once")
        _within("diagnosis", self, sets=(4, 1000), replicates=(1, 99), effect_sets=(4, 1000), verify_replicates=(2, 99))
        # Above the largest seed, those of fingerprints and confirming runs would be more than YADE takes.
        _within("diagnosis", self, seed=(0, 1_500_000_000), budget_core_hours=(0, 1e12))


@dataclass(frozen=True)
class Case:
    """Everything one calibration needs.

    path : the TOML file; measured : the lab file; truth : the known answer of a synthetic lab (or empty).
    """

    name: str
    path: Path
    problem: Problem
    plan: Plan = field(default_factory=Plan)
    interpolation: Interpolation = field(default_factory=Interpolation)
    search: Search = field(default_factory=Search)
    verify: Replicates = field(default_factory=Replicates)
    validate: Replicates = field(default_factory=lambda: Replicates(3, 600_000, 0))
    run: Running = field(default_factory=Running)
    cluster: Cluster = field(default_factory=Cluster)
    truth: dict[str, float] = field(default_factory=dict)
    about: str = ""
    measured: Path = Path()
    observables: tuple[Observable, ...] = ()
    conditions: dict[str, Condition] = field(default_factory=dict)
    diagnosis: Diagnosis = field(default_factory=Diagnosis)
    nuisances: tuple[Nuisance, ...] = ()

    def __post_init__(self) -> None:
        sets = math.prod(p.samples for p in self.problem.parameters) if self.plan.design == "grid" else self.plan.sets
        runs = sets * self.plan.replicates * len(self.problem.calibration_setups)
        if runs > MOST_RUNS:
            raise CalibratorError(f"the plan has {runs:,} runs: lower samples, sets or replicates to at most {MOST_RUNS:,} runs")
        for key, settings in (
            ("run", self.run),
            ("verify", self.verify),
            ("validate", self.validate),
            ("diagnosis", self.diagnosis),
        ):
            if settings.shipped:
                named_file(self.path, settings.shipped, f"{key}.shipped")

    @property
    def shipped(self) -> Path | None:
        """The response database that may serve as a start, relative to the case file; None where none is named."""
        return named_file(self.path, self.run.shipped, "shipped") if self.run.shipped else None

    def without_shipped_verification(self) -> Case:
        """The same case, for which verification and validation have to be run here."""
        verify, validate = (dataclasses.replace(s, shipped="") for s in (self.verify, self.validate))
        return dataclasses.replace(self, verify=verify, validate=validate)


def _within(section: str, settings: Any, **bounds: tuple[float, float]) -> None:
    for name, (low, high) in bounds.items():
        value = getattr(settings, name)
        if not is_number(value) or value < low:
            raise CalibratorError(f"{section}.{name} = {shown(value)}: give {low} or more")
        if value > high:
            raise CalibratorError(f"{section}.{name} = {shown(value)}: give {high:g} or less")


CASE_MEGABYTES = 0.25

SECTIONS = {
    "plan": Plan,
    "interpolation": Interpolation,
    "search": Search,
    "verify": Replicates,
    "validate": Replicates,
    "run": Running,
    "cluster": Cluster,
    "diagnosis": Diagnosis,
}


def read_case(path: str | Path, site: Path | None = None, lab: Path | None = None) -> Case:
    """Read and check a case file, and the [cluster] table of a site file. lab : lab file to read instead of the case's own.

    Raises CalibratorError with the offending key and what to write instead.
    """
    path = Path(path)
    tables = _load(path)
    if "shell" in _table(tables.get("cluster", {}), "cluster"):  # a case may come from anybody
        raise CalibratorError("cluster.shell in a case file: move it to a site file of your own, given with --site")
    if site is not None:
        tables["cluster"] = _with_site(tables.get("cluster", {}), site)
    for key in tables:
        known(
            key,
            ("name", "about", "measured", "parameters", "fixed", "setups", "targets", "truth_file", "conditions", *SECTIONS),
            "key in the case file",
        )
    if not isinstance(tables.get("name"), str) or not re.fullmatch("[A-Za-z0-9_]{1,64}", tables["name"]):
        raise CalibratorError('name is missing or not a plain word: add name = "my_sand" (at most 64 of A-Z, a-z, 0-9 and _)')
    settings = {key: _build(cls, tables[key], key) for key, cls in SECTIONS.items() if key in tables}
    truth = _truth(path, tables["truth_file"]) if "truth_file" in tables else {}
    about = _typed("about", "str", tables.get("about", ""))
    measured = lab or _measured(tables, path)
    observables, conditions = read_lab(measured), _conditions(tables)
    for one in observables:
        if one.condition and conditions[known(one.condition, conditions, "condition")].setup != one.setup:
            raise CalibratorError(f"{one.key}: the condition belongs to {conditions[one.condition].setup}; correct the lab file")
    nuisances = _nuisances(settings.get("diagnosis", Diagnosis()), path, observables)
    return Case(
        tables["name"],
        path,
        _problem(tables, observables),
        about=about,
        truth=truth,
        measured=measured,
        observables=tuple(observables),
        conditions=conditions,
        nuisances=nuisances,
        **settings,
    )


def _with_site(own: dict[str, Any], path: Path) -> dict[str, Any]:
    """The case's [cluster] and the site's together; a key with two values is refused, so that neither wins unnoticed."""
    tables = _load(path)
    for key in tables:
        known(key, ("cluster",), "key in the site file")
    site = _table(tables.get("cluster", {}), "cluster")
    for key in own:
        if key in site and own[key] != site[key]:
            raise CalibratorError(f"cluster.{key} differs in the case and in {path}: delete one of them")
    return {**site, **own}


def _load(path: Path) -> dict[str, Any]:
    try:
        return _plain(tomllib.loads(read_text(path, CASE_MEGABYTES)))
    except FileNotFoundError:
        raise CalibratorError(f"no case file {path}: give the path of a TOML file such as cases/coarse_sand.toml") from None
    except OSError as error:
        raise CalibratorError(f"cannot read {path} ({error}): give a readable TOML file") from None
    except (ValueError, RecursionError) as error:  # also an integer of thousands of digits, and brackets without end
        raise CalibratorError(f"{path} is not valid TOML ({error}): correct that line") from None


def _plain(value: Any, depth: int = 0) -> Any:
    """The value itself; ValueError where it is nested deeper than any case, or an integer is none by TOML's own limit."""
    if depth > 10:
        raise ValueError("tables or lists nested more than ten deep")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("an integer beyond 64 bits")
    for one in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        _plain(one, depth + 1)
    return value


def _build(cls: type, table: Any, where: str) -> Any:
    """Make a settings dataclass from a TOML table; unknown keys and wrong types are refused."""
    if not isinstance(table, dict):
        raise CalibratorError(f"{where} must be a table: write [{where}] on a line of its own")
    fields = {f.name: f for f in dataclasses.fields(cls)}
    values = {}
    for key, value in table.items():
        known(key, fields, f"key in [{where}]")
        values[key] = _typed(f"{where}.{key}", str(fields[key].type), value)
    try:
        return cls(**values)
    except TypeError as error:
        raise CalibratorError(f"[{where}] is incomplete ({error}): add the missing key") from None


def _typed(where: str, annotation: str, value: Any) -> Any:
    if annotation == "tuple[str, ...]" and isinstance(value, list) and all(isinstance(v, str) for v in value):
        return tuple(value)
    if annotation == "float" and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if annotation == "dict[str, float]" and isinstance(value, dict):
        return {name: _typed(f"{where}.{name}", "float", one) for name, one in value.items()}
    if annotation == "int" and isinstance(value, int) and not isinstance(value, bool):
        return value
    if annotation == "bool" and isinstance(value, bool):
        return value
    if annotation == "str" and isinstance(value, str):
        return value
    raise CalibratorError(f"{where} = {shown(value)}: give a value of type {annotation}")


def _measured(tables: dict[str, Any], path: Path) -> Path:
    if not isinstance(tables.get("measured"), str):
        raise CalibratorError('measured is missing: add measured = "lab.csv", the file with the measured responses')
    return named_file(path, tables["measured"], "measured")


def _conditions(tables: dict[str, Any]) -> dict[str, Condition]:
    conditions = {}
    for name, spec in _table(tables.get("conditions", {}), "conditions").items():
        where = f"conditions.{name}"
        if not re.fullmatch("[A-Za-z0-9_]{1,64}", name):
            raise CalibratorError(f"{where}: the name is not a plain word; use A-Z, a-z, 0-9 and _")
        values = dict(_table(spec, where))
        setup = known(values.pop("setup", ""), SETUPS, f"set-up of {where}")
        own = {n: q for n, q in parameters_of(setup).items() if n != "seed"}
        conditions[name] = Condition(
            setup, {known(n, own, f"parameter of {where}"): checked_value(n, v) for n, v in values.items()}
        )
    return conditions


def _nuisances(diagnosis: Diagnosis, path: Path, observables: list[Observable]) -> tuple[Nuisance, ...]:
    if not diagnosis.nuisances:
        return ()
    return tuple(read_nuisances(named_file(path, diagnosis.nuisances, "diagnosis.nuisances"), observables))


def _problem(tables: dict[str, Any], observables: list[Observable]) -> Problem:
    parameters = tuple(_parameter(name, spec) for name, spec in _table(tables.get("parameters", {}), "parameters").items())
    fixed = {n: checked_value(n, v) for n, v in _table(tables.get("fixed", {}), "fixed").items()}
    if "seed" in fixed:
        raise CalibratorError("seed cannot be fixed: replicates need different seeds; set plan.seed instead")
    targets = _targets(tables, observables)
    return Problem(
        parameters,
        targets=tuple(t for role, t in targets if role == "calibrate"),
        held_out=tuple(t for role, t in targets if role == "held_out"),
        fixed=fixed,
        setups=_setups(tables),
    )


def _parameter(name: str, spec: Any) -> Parameter:
    where = f"parameters.{known(name, PARAMETERS, 'parameter')}"
    if "name" in _table(spec, where):
        raise CalibratorError(f"{where} has a key name: remove it, the table's heading is the name")
    return _build(Parameter, {"name": name, **spec}, where)


def _setups(tables: dict[str, Any]) -> dict[str, dict[str, Value]]:
    setups: dict[str, dict[str, Value]] = {}
    for setup, spec in _table(tables.get("setups", {}), "setups").items():
        own = parameters_of(known(setup, SETUPS, "set-up"))
        setups[setup] = {
            known(n, own, f"parameter of {setup}"): checked_value(n, v) for n, v in _table(spec, f"setups.{setup}").items()
        }
    return setups


def _table(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise CalibratorError(f"{where} must be a table: write [{where}] on a line of its own")
    return value


def _targets(tables: dict[str, Any], observables: list[Observable]) -> list[tuple[str, Target]]:
    """(role, target) of every row to calibrate or to validate with; [targets."setup.response"] may set weight and tolerance."""
    options = _table(tables.get("targets", {}), "targets")
    rows = [(one.role, one.target()) for one in observables if one.role != "diagnose" and not one.condition]
    targets = []
    for role, target in rows:
        extra = {
            k: _typed(f"targets.{target.key}.{known(k, ('weight', 'tolerance'), 'target option')}", "float", v)
            for k, v in _table(options.get(target.key, {}), f"targets.{target.key}").items()
        }
        targets.append((role, dataclasses.replace(target, **extra)))
    for key in options:
        known(key, [o.key for o in observables], "target")
    return targets


def _truth(path: Path, name: Any) -> dict[str, float]:
    """The parameters behind a synthetic lab, read only to print how far the calibration is from them."""
    tables = _load(named_file(path, _typed("truth_file", "str", name), "truth_file"))
    for key in tables:
        known(key, ("parameters",), "table in the truth file")
    given = _table(tables.get("parameters", {}), "parameters").items()
    return {n: _typed(f"{name}: {n}", "float", checked_value(n, v)) for n, v in given}
