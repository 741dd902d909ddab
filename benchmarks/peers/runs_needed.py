"""Runs until the recommended set, verified, meets every target: our adaptive design, other designs,
and two peers.

    python -m benchmarks.peers.runs_needed                    about 20 minutes on one core; the first time
    pip fetches the peers python -m benchmarks.peers.runs_needed --quick            two seeds, prints
    only: a smoke test python -m benchmarks.peers.runs_needed --database D.csv   another database of the
    same case python -m benchmarks.peers.runs_needed --methods "a;b"    only these, nothing written

Writes benchmarks/results/runs_needed.json and .png. No simulation: a run is the mean of Gaussian
processes through the real runs of cases/quartz_sand_reduced.toml plus normal noise of the size that
its replicates show. Every seed draws a true set from the central 80 % of each range; its mean
responses are the targets, so they can be met. A set meets them where each noise-free response lies
within 2 % or, where that is more, two standard errors of the mean of three runs.

Who counts what. Ours and the Sobol design stop by their own verification and are judged by the
noise-free surface, which they never see: a confirmed set that misses is a failure. The peers have
no verification, and are counted in three ways. Oracle, their `median_runs`: after each of their
rounds whatever they would recommend is judged by the noise-free surface, and the first hit counts,
plus three runs to verify it; nobody has such an oracle, so this is a lower bound, given for ours as
well. Verified: what they report is verified by three runs after each round, as the Sobol design's
is, and the first that passes counts. By itself: they stop by their own rule, and three runs verify
what they report. Parameters on a log scale reach them as logarithms. The surface being a Gaussian
process suits methods that fit one; the peers see only responses.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import RESULTS, rounded, write
from benchmarks.peers.client import REQUIRED, Peer
from calibrator.case.case import Case
from calibrator.case.problem import Problem, Target, Value
from calibrator.case.toml import read_case
from calibrator.plan.adaptive import Settings, bands, is_met, propose
from calibrator.plan.design import full_grid, sobol
from calibrator.responses.box import box_sample, refined
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.objectives import evaluation
from calibrator.responses.table import response_table
from calibrator.runs.database import Database
from calibrator.search.reach import unreachable

CASE = Path(__file__).resolve().parents[2] / "cases" / "quartz_sand_reduced.toml"
RESPONSES = (
    "hourglass.bulk_density",
    "hourglass.drained_equivalent_angle_deg",
    "hourglass.mass_flow_rate",
)
FEW: dict[str, Value] = {
    "particle_radius": 0.4e-3,
    "particle_density": 2800.0,
    "young_modulus": 5e6,
}  # fixed where only frictions are sought
GRID = {2: (5, 6), 5: (5, 6, 3, 3, 3)}  # samples of the reference paper's grids
FIRST = {2: 5, 5: 10}  # sets that our design starts with
BAR = {2: 25, 5: 60}
TOLERANCE = 0.02
VERIFYING = 3  # runs
MOST_RUNS = 600
OURS = "adaptive (ours)"
# methods for one number of parameters: its rule gives 7 for two, which is few
ONLY = {"GrainLearning, 20 samples": 2}
BEYOND = 1.07  # of the largest density that the box reaches: the target that cannot be met


@dataclass(frozen=True, eq=False)
class Surface:
    """The truth: mean responses over the case's parameters, and the seed noise (t,) of a run."""

    case: Case
    interpolant: Interpolant

    @classmethod
    def of(cls, case: Case, database: Path) -> Surface:
        """Fitted to the good hourglass runs of a database."""
        points, values = response_table(
            case.problem, list(Database.read(database).records.values()), RESPONSES
        )
        return cls(
            case,
            fit_responses(
                case.problem, points, values, RESPONSES, similarity=case.interpolation.similarity
            ),
        )

    @property
    def noise(self) -> np.ndarray:
        """Seed noise of a single run (t,)."""
        return self.interpolant.noise

    def problem(self, count: int) -> Problem:
        """The case's problem with so many parameters: all, or the frictions.

        Targets are still to be set.
        """
        kept = [p for p in self.case.problem.parameters if count == 5 or p.name not in FEW]
        fixed = FEW if count == 2 else {}
        samples = [
            dataclasses.replace(p, samples=n) for p, n in zip(kept, GRID[count], strict=True)
        ]
        return dataclasses.replace(
            self.case.problem, parameters=tuple(samples), held_out=(), fixed=fixed
        )

    def mean(self, problem: Problem, points: np.ndarray) -> np.ndarray:
        """Noise-free responses (k, t) at points (k, d) of such a problem."""
        columns = problem.columns(points)
        full = [np.broadcast_to(columns[name], len(points)) for name in self.case.problem.names]
        return self.interpolant.predict(np.column_stack(full))


@dataclass(eq=False)
class Trial:
    """One calibration to be done: a problem with targets, runs that are counted, and the judgement
    of a set.
    """

    surface: Surface
    problem: Problem
    seed: int
    made: int = 0
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 1])

    @property
    def similarity(self) -> bool:
        """Whether the density can be taken out by similarity."""
        return self.surface.case.interpolation.similarity and len(self.problem.names) == 5

    def run(self, points: np.ndarray) -> np.ndarray:
        """Responses (k, t) of one run at each of the points (k, d)."""
        self.made += len(points)
        mean = self.surface.mean(self.problem, points)
        return mean + self.surface.noise * self.rng.standard_normal(mean.shape)

    def missed(self, points: np.ndarray) -> np.ndarray:
        """Distance (k, t) of the noise-free responses at points (k, d) from the targets."""
        return np.abs(
            self.surface.mean(self.problem, points) - [t.value for t in self.problem.targets]
        )

    def worst(self, point: np.ndarray) -> float:
        """Largest relative error of the noise-free responses at a set (d,)."""
        return float(
            (self.missed(point[None])[0] / np.abs([t.value for t in self.problem.targets])).max()
        )

    def meets(self, point: np.ndarray) -> bool:
        """Whether every noise-free response at a set (d,) lies within the tolerance, or the noise
        of three runs.
        """
        return bool(self.met(point[None])[0])

    def met(self, points: np.ndarray) -> np.ndarray:
        """`meets` (k,) for points (k, d)."""
        return np.all(
            self.missed(points) <= bands(self.problem.targets, self.surface.noise, VERIFYING),
            axis=1,
        )

    def share(self) -> float:
        """Share of the box that meets the targets: the chance of a set drawn at random."""
        return float(
            self.met(
                box_sample(self.problem.low, self.problem.high, 2**12, np.random.default_rng(0))
            ).mean()
        )


def reachable_trial(surface: Surface, count: int, seed: int) -> Trial:
    """Targets that a set in the central 80 % of each range has."""
    problem = surface.problem(count)
    shares = np.random.default_rng([seed, 0]).uniform(0.1, 0.9, count)
    truth = np.array([p.values_at(s) for p, s in zip(problem.parameters, shares, strict=True)])
    return Trial(surface, with_targets(problem, surface.mean(problem, truth[None])[0]), seed)


def unreachable_trial(surface: Surface, count: int, seed: int) -> Trial:
    """The same, but for a density beyond the largest of the box."""
    trial = reachable_trial(surface, count, seed)
    values = np.array([t.value for t in trial.problem.targets])
    sample = box_sample(trial.problem.low, trial.problem.high, 2**12, np.random.default_rng(0))
    values[0] = BEYOND * surface.mean(trial.problem, sample)[:, 0].max()
    return Trial(surface, with_targets(trial.problem, values), seed)


def with_targets(problem: Problem, values: np.ndarray) -> Problem:
    """The problem with these values (t,) of the responses as targets."""
    names = [key.split(".") for key in RESPONSES]
    targets = (
        Target(setup, name, float(v), tolerance=TOLERANCE)
        for (setup, name), v in zip(names, values, strict=True)
    )
    return dataclasses.replace(problem, targets=tuple(targets))


@dataclass(frozen=True)
class Outcome:
    """How a method ended.

    runs : all of them, verification included; met : whether the recommended set meets the targets;
    worst : its largest relative error; said : the method's last words; flagged : whether it says
    that the targets are out of reach; oracle : for ours, runs and success where an oracle ends it;
    verified, by_itself : for peers, where three runs verify each round's set, and by their own rule
    for stopping.
    """

    runs: int
    met: bool
    worst: float
    said: str
    flagged: bool = False
    oracle: tuple[int, bool] | None = None
    verified: tuple[int, bool] | None = None
    by_itself: tuple[int, bool] | None = None


# Methods: each takes a trial and whether to stop at the first hit


def adaptive(trial: Trial) -> Outcome:
    """Our adaptive design, with the first sets and replicates that `calibrator run` starts it with."""
    own = trial.problem
    settings = Settings(replicates=VERIFYING, budget=MOST_RUNS)
    first = sobol(own, FIRST[len(own.names)])
    points = np.repeat(first, [VERIFYING] * 2 + [1] * (len(first) - 2), axis=0)
    values, hit = trial.run(points), None
    while not (proposal := propose(own, points, values, settings, trial.similarity)).stops:
        if hit is None and trial.meets(proposal.recommended):
            hit = trial.made + VERIFYING, True
        points, values = (
            np.vstack([points, proposal.points]),
            np.vstack([values, trial.run(proposal.points)]),
        )
    point, confirmed = proposal.recommended, proposal.kind == "confirmed"
    said = f"{proposal.kind}: {proposal.sentence}"
    met, flagged = confirmed and trial.meets(point), proposal.kind == "unreachable"
    return Outcome(trial.made, met, trial.worst(point), said, flagged, hit or (trial.made, met))


def grid(trial: Trial) -> Outcome:
    """The paper's full grid, multilinear; the set of smallest error O1, by direct minimisation
    instead of a search of minutes.
    """
    interpolant = fitted(trial, full_grid(trial.problem), "multilinear")
    point = least_error(trial.problem, interpolant)
    # a grid without replicates knows no noise: the true one is lent
    passed = verified(trial, point, trial.surface.noise)
    reach = unreachable(trial.problem, interpolant).joint
    said = f"verification {'passed' if passed else 'failed'}; {reach.sentence}"
    return Outcome(trial.made, trial.meets(point), trial.worst(point), said, not reach.reachable)


def sobol_process(trial: Trial) -> Outcome:
    """Nested Sobol designs of 10, 15, 20, ... sets, the process's best set verified each time,
    until one passes.
    """
    points = sobol(trial.problem, MOST_RUNS)
    values = np.empty((0, len(RESPONSES)))
    for count in range(10, MOST_RUNS, 5):
        values = np.vstack([values, trial.run(points[len(values) : count])])
        interpolant = fit_responses(
            trial.problem, points[:count], values, RESPONSES, similarity=trial.similarity
        )
        point = least_error(trial.problem, interpolant)
        passed = verified(trial, point, interpolant.noise)
        reach = unreachable(trial.problem, interpolant).joint
        if passed or not reach.reachable or trial.made >= MOST_RUNS:
            break
    said = f"verification {'passed' if passed else 'failed'}; {reach.sentence}"
    return Outcome(
        trial.made,
        passed and trial.meets(point),
        trial.worst(point),
        said,
        not (passed or reach.reachable),
    )


def fitted(trial: Trial, points: np.ndarray, method: str) -> Interpolant:
    """An interpolant through one run at each of the points (n, d)."""
    return fit_responses(trial.problem, points, trial.run(points), RESPONSES, method)


def least_error(problem: Problem, interpolant: Interpolant) -> np.ndarray:
    """The set (d,) of smallest O1 that a sample, refined around its best, finds."""
    rng = np.random.default_rng(1)
    evaluate = evaluation(problem, interpolant, ["error"])
    sample = box_sample(problem.low, problem.high, 2**12, rng)
    return refined(
        lambda p: evaluate(p)[:, 0], sample[np.argmin(evaluate(sample)[:, 0])], problem, rng
    )


def verified(trial: Trial, point: np.ndarray, noise: np.ndarray) -> bool:
    """Whether the mean of fresh runs at a set (d,) meets every target."""
    return is_met(
        trial.problem.targets, trial.run(np.repeat(point[None], VERIFYING, axis=0)), noise
    )


class Peers:
    """Both peers' drivers, started when they are first needed."""

    def __init__(self) -> None:
        self._drivers: dict[str, Peer] = {}

    def calibrate(self, name: str, options: dict[str, Any], trial: Trial) -> Outcome:
        """A peer to its own end, or to MOST_RUNS."""
        rounds: list[tuple[int, np.ndarray]] = []
        ended = self._driver(name).calibrate(
            trial.problem,
            trial.run,
            lambda sets: rounds.append((trial.made, sets)),
            trial.seed,
            MOST_RUNS,
            options,
        )
        made = trial.made
        last = rounds[-1][1][0] if rounds else (trial.problem.low + trial.problem.high) / 2
        hits = ((runs, one) for runs, sets in rounds for one in sets if trial.meets(one))
        runs, point = next(hits, (made, last))
        by_itself = (
            made + VERIFYING,
            not (ended["stopped"] or ended["error"]) and trial.meets(last),
        )
        said = closing("\n".join([ended["said"], ended["error"]]))
        found = first_verified(trial, rounds) or (made + VERIFYING * len(rounds), False)
        return Outcome(
            runs + VERIFYING,
            trial.meets(point),
            trial.worst(point),
            said,
            False,
            None,
            found,
            by_itself,
        )

    def _driver(self, name: str) -> Peer:
        if name not in self._drivers:
            self._drivers[name] = Peer(name)
        return self._drivers[name]

    def close(self) -> None:
        """End the drivers."""
        for driver in self._drivers.values():
            driver.close()


def first_verified(trial: Trial, rounds: list[tuple[int, np.ndarray]]) -> tuple[int, bool] | None:
    """Runs and success where the set reported after each round is verified until one passes;

    None where none does.
    """
    for number, (made, sets) in enumerate(rounds, 1):
        if verified(trial, sets[0], trial.surface.noise):
            return made + VERIFYING * number, trial.meets(sets[0])
    return None


def closing(said: str) -> str:
    """The last words of what a peer printed: its last paragraphs, without blank lines."""
    lines = [line.rstrip() for line in said.splitlines() if line.strip()]
    begins = [i for i, line in enumerate(lines) if line.startswith("Bayesian calibration iter")]
    return "\n".join(lines[begins[-1] if begins else 0 :][-14:])


def methods(peers: Peers) -> dict[str, Callable[[Trial], Outcome]]:
    """All methods by name."""
    learning = partial(peers.calibrate, "grainlearning")
    access = partial(peers.calibrate, "coexist")
    return {
        OURS: adaptive,
        "Sobol + process": sobol_process,
        "full grid": grid,
        "GrainLearning": partial(learning, {}),
        "GrainLearning, 20 samples": partial(learning, {"num_samples": 20}),
        "GrainLearning, tiny sigma_tol": partial(learning, {"sigma_tol": 1e-5}),
        "ACCES, sum of squares": partial(access, {"combiner": "squares"}),
        "ACCES, Product": partial(access, {"combiner": "product"}),
    }


# Statistics


def median_runs(runs: list[int], met: list[bool]) -> float | None:
    """Median in which a failure counts as infinitely many runs; None where that is the median."""
    found = float(np.median([r if m else np.inf for r, m in zip(runs, met, strict=True)]))
    return found if math.isfinite(found) else None


def reachable_row(outcomes: list[Outcome]) -> dict[str, Any]:
    """What a method needed over all seeds."""
    runs, met = [o.runs for o in outcomes], [o.met for o in outcomes]
    row: dict[str, Any] = {
        "median_runs": median_runs(runs, met),
        "failures": met.count(False),
        "seeds": len(outcomes),
        "worst_relative_error_median": rounded(float(np.median([o.worst for o in outcomes])), 3),
        "runs": runs,
        "met": met,
    }
    for way in ("oracle", "verified", "by_itself"):
        pairs = [pair for o in outcomes if (pair := getattr(o, way))]
        if pairs:
            runs, met = [r for r, _ in pairs], [m for _, m in pairs]
            row[way] = {
                "median_runs": median_runs(runs, met),
                "failures": met.count(False),
                "runs": runs,
                "met": met,
            }
    return row


def unreachable_row(outcomes: list[Outcome]) -> dict[str, Any]:
    """How a method ended where no set meets the targets; its words are those of the first seed."""
    return {
        "flagged": sum(o.flagged for o in outcomes),
        "seeds": len(outcomes),
        "median_runs": float(
            np.median([o.by_itself[0] if o.by_itself else o.runs for o in outcomes])
        ),
        "worst_relative_error_median": rounded(float(np.median([o.worst for o in outcomes])), 3),
        "said": outcomes[0].said,
    }


def measure(surface: Surface, seeds: int, chosen: list[str]) -> dict[str, Any]:
    """All results, by scenario, number of parameters and method."""
    peers = Peers()
    makers = {
        "reachable": (reachable_trial, reachable_row),
        "unreachable": (unreachable_trial, unreachable_row),
    }
    results: dict[str, Any] = {scenario: {} for scenario in makers}
    try:
        for scenario, count in itertools.product(makers, BAR):
            make, summary = makers[scenario]
            rows = results[scenario][str(count)] = {}
            for name, method in methods(peers).items():
                if (chosen and name not in chosen) or ONLY.get(name, count) != count:
                    continue
                begin = time.perf_counter()
                rows[name] = summary(
                    [method(make(surface, count, seed)) for seed in range(1, seeds + 1)]
                )
                print(
                    scenario,
                    count,
                    name,
                    rows[name],
                    f"{time.perf_counter() - begin:.0f} s",
                    flush=True,
                )
    finally:
        peers.close()
    return results


def verdicts(reachable: dict[str, Any]) -> dict[str, Any]:
    """Ours against the bar and, in each of the three ways to count, the best peer; for each number
    of parameters.
    """
    found = {}
    for count, rows in reachable.items():
        by_oracle = rows[OURS]["oracle"]["median_runs"]
        found[count] = {
            "bar": BAR[int(count)],
            "ours": rows[OURS]["median_runs"],
            "ours_by_oracle": by_oracle,
        }
        for way in ("oracle", "verified", "by_itself"):
            ours = by_oracle if way == "oracle" else rows[OURS]["median_runs"]
            medians = {
                p: (rows[p] if way == "oracle" else rows[p][way])["median_runs"]
                for p in rows
                if "by_itself" in rows[p]
            }
            best = min(medians, key=lambda p: medians[p] or math.inf)
            fewer = rounded(medians[best] / ours, 3) if ours and medians[best] else None
            found[count][f"best_peer_{way}"] = {
                "method": best,
                "median_runs": medians[best],
                "times_ours": fewer,
            }
    return found


# Figure


def plot(reachable: dict[str, Any], folder: Path) -> None:
    """Runs of every seed by method, one panel for each number of parameters; peers in each way to
    count.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from calibrator.report.figures.style import BLUE, GREEN, GREY, INK, ORANGE, RED, SKY, STYLE

    ways = {
        "ours": (RED, "ours"),
        "design": (GREEN, "other designs"),
        "oracle": (BLUE, "peer, judged by an oracle after each round"),
        "verified": (SKY, "peer, verified after each round"),
        "by_itself": (ORANGE, "peer, stopping by itself"),
    }
    with matplotlib.rc_context(STYLE):
        figure, panels = plt.subplots(1, 2, figsize=(10, 6), sharey=True)
        names = list(dict.fromkeys(name for rows in reachable.values() for name in rows))
        for axis, (count, rows) in zip(panels, reachable.items(), strict=True):
            for name, row in rows.items():
                place = names.index(name)
                peer = {
                    "oracle": row,
                    "verified": row.get("verified"),
                    "by_itself": row.get("by_itself"),
                }
                strips = peer if "by_itself" in row else {"ours" if name == OURS else "design": row}
                for offset, (way, strip) in zip(
                    (-0.27, 0, 0.27) if len(strips) > 1 else (0,), strips.items(), strict=True
                ):
                    draw_strip(axis, place + offset, strip, ways[way][0], INK)
            bar = BAR[int(count)]
            axis.axvline(bar, color=GREY, linestyle="--", linewidth=1)
            axis.text(bar, -0.62, f" bar: {bar}", color=GREY, va="center")
            axis.set(
                xscale="log",
                xlabel="runs, verification included",
                title=f"{count} parameters",
                xlim=(7, 1100),
            )
            axis.set_xticks([10, 30, 100, 300, 1000], ["10", "30", "100", "300", "1000"])
            axis.minorticks_off()
        panels[0].set_yticks(range(len(names)), names)
        panels[0].set_ylim(len(names) - 0.5, -0.9)
        handles = [
            plt.Line2D([], [], ls="", marker="o", color=colour, label=label)
            for colour, label in ways.values()
        ]
        handles.append(plt.Line2D([], [], ls="", marker="x", color=INK, label="a seed that fails"))
        median: dict[str, Any] = {"marker": "|", "markersize": 11, "markeredgewidth": 2}
        handles.append(
            plt.Line2D([], [], ls="", color=INK, label="median, failures as infinity", **median)
        )
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
        figure.savefig(folder / "runs_needed.png", dpi=150)


def draw_strip(axis: Any, place: float, strip: dict[str, Any], colour: str, ink: str) -> None:
    """The seeds of one method, and their median where half of them or more succeed."""
    styles: dict[bool, dict[str, Any]] = {
        True: {"marker": "o", "color": colour},
        False: {"marker": "x", "color": ink},
    }
    for hit, style in styles.items():
        runs = [r for r, m in zip(strip["runs"], strip["met"], strict=True) if m == hit]
        axis.plot(runs, jittered(place, len(runs)), ls="", markersize=4, alpha=0.7, **style)
    if strip["median_runs"]:
        axis.plot(
            [strip["median_runs"]] * 2, [place - 0.13, place + 0.13], color=colour, linewidth=2.4
        )


def jittered(place: float, count: int) -> np.ndarray:
    """Heights (count,) around a row, so that equal numbers are seen."""
    return place + 0.16 * (np.arange(count) % 5 - 2) / 4


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two seeds, nothing written")
    parser.add_argument(
        "--database", type=Path, help="runs of the case, if not those that it ships with"
    )
    parser.add_argument(
        "--methods",
        type=lambda s: s.split(";"),
        default=[],
        help="names separated by semicolons; nothing written",
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder to write to")
    return parser.parse_args()


def main() -> None:
    """Measure, write, draw."""
    given = arguments()
    case = read_case(CASE)
    database = given.database or case.shipped
    if database is None:
        raise SystemExit(f"{CASE.name} ships no database: give one with --database")
    surface = Surface.of(case, database)
    measured = measure(surface, 2 if given.quick else given.seeds, given.methods)
    if given.quick or given.methods:
        return
    about = (__doc__ or "").split("\n\n")
    results: dict[str, Any] = {
        "about": " ".join(" ".join(about[2:]).split()),
        "data": {
            "share_of_the_box_that_meets_the_targets": {
                count: rounded(
                    float(
                        np.median(
                            [
                                reachable_trial(surface, count, s).share()
                                for s in range(1, given.seeds + 1)
                            ]
                        )
                    ),
                    3,
                )
                for count in BAR
            },
            "sets": len(surface.interpolant.points),
            "noise": dict(
                zip(RESPONSES, map(partial(rounded, digits=3), surface.noise.tolist()), strict=True)
            ),
            "peers": REQUIRED,
            "most_runs": MOST_RUNS,
        },
        "verdict": verdicts(measured["reachable"]),
        **measured["reachable"],
        "unreachable": measured["unreachable"],
    }
    write("runs_needed", results, given.results)
    plot(measured["reachable"], given.results)


if __name__ == "__main__":
    main()
