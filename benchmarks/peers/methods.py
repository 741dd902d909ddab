"""Methods of calibration: each takes a trial and says how it ended."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from benchmarks.peers.client import Peer
from benchmarks.peers.trial import MOST_RUNS, VERIFYING, Trial
from benchmarks.peers.truth import RESPONSES
from calibrator.case.problem import Problem
from calibrator.plan.adaptive import Settings, is_met, propose
from calibrator.plan.design import full_grid, sobol
from calibrator.responses.box import refined, sample_of
from calibrator.responses.fit import fit_responses
from calibrator.responses.interpolant import Interpolant
from calibrator.responses.objectives import evaluation
from calibrator.search.reach import unreachable

OURS = "adaptive (ours)"
# methods for tasks of so many parameters: its rule gives 7 for two, which is few
ONLY = {"GrainLearning, 20 samples": 2}
# What a line that speaks of targets out of reach could hold; what a tool prints of every target,
# reachable or not, is counted for those in reach as well.
WORDS = re.compile(
    r"reach|cannot|can not|could not|unable|infeasib|impossib|not (?:be )?met|no solution|fail"
    r"|outside|diverg|not converge",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Outcome:
    """How a method ended.

    runs : all of them, verification included; met : whether the recommended set meets the targets;
    worst : its largest relative error; said : the method's last words; flagged : whether it says
    that the targets are out of reach, None for peers, which have no such verdict; oracle : for
    ours, runs and success where an oracle ends it; verified, by_itself : for peers, where three
    runs verify each round's set, and by their own rule for stopping; ended : by what a peer ended;
    spoken : lines of all that it printed, warnings too, that could speak of reach; own_error : the
    last error that it printed, in its own measure.
    """

    runs: int
    met: bool
    worst: float
    said: str
    flagged: bool | None = None
    oracle: tuple[int, bool] | None = None
    verified: tuple[int, bool] | None = None
    by_itself: tuple[int, bool] | None = None
    ended: str = ""
    spoken: tuple[str, ...] = ()
    own_error: float | None = None


def adaptive(trial: Trial) -> Outcome:
    """Our adaptive design, with the first sets and replicates of `calibrator run`."""
    own = trial.problem
    settings = Settings(replicates=VERIFYING, budget=MOST_RUNS)
    first = sobol(own, trial.task.first)
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
    """The paper's full grid, multilinear; the set of smallest error O1.

    It is found by direct minimisation instead of a search of minutes.
    """
    interpolant = fitted(trial, full_grid(trial.problem), "multilinear")
    point = least_error(trial.problem, interpolant)
    # a grid without replicates knows no noise: the true one is lent
    passed = verified(trial, point, trial.surface.noise)
    reach = unreachable(trial.problem, interpolant).joint
    said = f"verification {'passed' if passed else 'failed'}; {reach.sentence}"
    return Outcome(trial.made, trial.meets(point), trial.worst(point), said, not reach.reachable)


def sobol_process(trial: Trial) -> Outcome:
    """Nested Sobol designs of 10, 15, 20, ... sets until the best set of one is verified."""
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
    sample = sample_of(problem, 2**12, rng)
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
        said = "\n".join([ended["said"], ended["error"]])
        found = first_verified(trial, rounds) or (made + VERIFYING * len(rounds), False)
        return Outcome(
            runs + VERIFYING,
            trial.meets(point),
            trial.worst(point),
            closing(said),
            verified=found,
            by_itself=by_itself,
            ended=how(ended),
            spoken=spoken(said + "\n" + ended["warned"]),
            own_error=own_error(ended["said"]),
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


def spoken(said: str) -> tuple[str, ...]:
    """Lines that could speak of reach, without the paths of a machine."""
    lines = (re.sub(r"\S*/", "", line).strip() for line in said.splitlines())
    return tuple(line for line in lines if WORDS.search(line))


def own_error(said: str) -> float | None:
    """The last error that a peer printed: GrainLearning's smallest, ACCES' of its best set."""
    found = re.findall(r"Smallest mean absolute percentage error =\s*([-+.\de]+)", said)
    found += re.findall(r"^ *value .*?([-+.\de]+)$", said, re.MULTILINE)
    return float(found[-1]) if found else None


def how(ended: dict[str, Any]) -> str:
    """By what a peer ended: by its own rule, by the benchmark's MOST_RUNS, or by an error."""
    if ended["error"]:
        return "died"
    return "cut off" if ended["stopped"] else "own rule"


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
