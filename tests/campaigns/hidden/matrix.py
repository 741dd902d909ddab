"""The laboratories of the last test: new truths from the whole box, in an order that stays fair.

They were set down before any of them was run, and no rule is made after a look at them. Rounds of
them are alike: five with nothing hidden, three with a strong effect, one or two with a weaker one
or a pair, and one with what is outside of the library, so that a test that stops early is a smaller
test of the same.
"""

from collections.abc import Sequence

import numpy as np

from calibrator.case.case import Case
from calibrator.diagnosis import experiments as ex
from calibrator.diagnosis.explanations import Effect

FIRST = 200  # index of the first class
ROUNDS = 12
NOTHING = 5 * ROUNDS
STRONG, OUTSIDE = 3 * ROUNDS, ROUNDS
PAIRS_EACH = 2
DRAW = 2_311  # of the truths; the runs have seeds of their own

Truth = tuple[str, str, dict[str, float], np.ndarray]


def truths(
    case: Case,
    effects: Sequence[Effect],
    sizes: dict[str, float],
    pairs: Sequence[tuple[str, str]],
    outside: Sequence[str],
) -> list[Truth]:
    """Label, strength, what is hidden and where in the unit square, in the order of the rounds.

    effects : those that can be told; sizes : amplitudes by strength, in the case's plausible
    scales; outside : kinds that the library does not have.
    """
    rng, d = np.random.default_rng(DRAW), len(case.problem.names)
    by_name = {e.name: e for e in effects}

    def hidden(name: str, strength: str) -> dict[str, float]:
        effect, size = by_name[name], sizes[strength]
        both = effect.bounds[0] <= -size
        sign = int(rng.choice([-1, 1])) if both else 1
        return {name: ex.column_value(effect, sign * size)}

    nothing = [(f"nothing {FIRST + i}", "none", {}) for i in range(NOTHING)]
    strong = [(n, "strong", hidden(n, "strong")) for n in in_turn(list(by_name), STRONG, rng)]
    weaker = [(n, s, hidden(n, s)) for n in by_name for s in sizes if s != "strong"]
    both = [
        (" and ".join(two), "pair", {n: ex.column_value(by_name[n], sizes["strong"]) for n in two})
        for two in pairs
        for _ in range(PAIRS_EACH)
    ]
    others = [(n, "outside", {n: 1.0}) for n in in_turn(outside, OUTSIDE, rng)]
    mixed = [weaker[i] for i in rng.permutation(len(weaker))] + both
    # a Latin square of those with nothing hidden, so that no edge of the box is left out
    cells = np.array([rng.permutation(NOTHING) for _ in range(d)]).T
    squares = iter((cells + rng.random((NOTHING, d))) / NOTHING)
    made: list[Truth] = []
    for turn in range(ROUNDS):
        for kind in (nothing, strong, mixed, others):
            for one in kind[turn * len(kind) // ROUNDS : (turn + 1) * len(kind) // ROUNDS]:
                made.append((*one, next(squares) if one[1] == "none" else rng.random(d)))
    return made


def in_turn(names: Sequence[str], count: int, rng: np.random.Generator) -> list[str]:
    """So many of the names, each as often as any other but for one, in shuffled turns."""
    turns = -(-count // len(names))
    return [names[i] for _ in range(turns) for i in rng.permutation(len(names))][:count]
