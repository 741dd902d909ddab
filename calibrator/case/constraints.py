"""Linear inequalities between parameters, as a case file says them.

They are parsed as an expression of sums, products with numbers and comparisons; nothing of it is
ever evaluated as code.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibrator.errors import CalibratorError, shown

LONGEST = 500  # characters of one constraint
LEAST_ROOM = 1e-3  # share of the box that constraints must leave
LARGEST = 1e300  # number: a larger integer is no float
EXAMPLE = 'write a linear inequality such as "rolling_friction <= sliding_friction"'


@dataclass(frozen=True)
class Constraint:
    """The sum of factor x parameter over names must be at most bound; text : as it was written."""

    text: str
    names: tuple[str, ...]
    factors: tuple[float, ...]
    bound: float

    def excess(
        self, columns: Mapping[str, np.ndarray], slopes: Mapping[str, np.ndarray | float]
    ) -> np.ndarray:
        """By how much (n,) it is broken, 0 where it holds, in shares of the parameters' scales.

        columns : values (n,) by name, NaN where unknown, which breaks nothing; slopes : change of
        each value with its share, there.
        """
        total, span = np.zeros((2, len(next(iter(columns.values())))))
        for name, factor in zip(self.names, self.factors, strict=True):
            total += factor * columns[name]
            span += abs(factor) * slopes[name]
        beyond = (total - self.bound) / span
        # equality is allowed, and rounding must not forbid it
        return np.where(np.isnan(beyond) | (beyond <= 1e-12), 0.0, beyond)


def require_room(
    constraints: Sequence[Constraint], excess: Callable[[np.ndarray], np.ndarray], dimensions: int
) -> None:
    """Raise CalibratorError where the constraints leave less than LEAST_ROOM of the box.

    excess : shares (n, dimensions) of the box -> (n,), 0 where all hold.
    """
    if not constraints:
        return
    room = float(np.mean(excess(np.random.default_rng(1).random((2**14, dimensions))) == 0))
    if room < LEAST_ROOM:
        raise CalibratorError(
            f"the constraints leave {'almost ' if room else ''}nothing of the box between the"
            f" bounds ({', '.join(c.text for c in constraints)}): correct them, or the bounds"
        )


def read_constraint(
    text: str, calibrated: Sequence[str], fixed: Mapping[str, float]
) -> list[Constraint]:
    """The inequalities that a text states; a chain such as a <= b <= c states two.

    Names are calibrated parameters or fixed ones. Raises CalibratorError, with what to write, for
    anything else.
    """
    where = f"constraint {shown(text)}"
    try:
        if len(text) > LONGEST:
            raise ValueError
        tree = ast.parse(text.strip(), mode="eval").body
    except (ValueError, SyntaxError, RecursionError, MemoryError):
        raise CalibratorError(f"{where} cannot be read: {EXAMPLE}") from None
    if not isinstance(tree, ast.Compare):
        raise CalibratorError(f"{where} is no inequality: {EXAMPLE}")
    sides = [_linear(side, where, calibrated, fixed) for side in (tree.left, *tree.comparators)]
    pairs = zip(itertools.pairwise(sides), tree.ops, strict=True)
    return [_inequality(text, where, left, right, op) for (left, right), op in pairs]


Linear = dict[str, float]
"""Factors by name; that of "" is the constant."""


def _inequality(text: str, where: str, left: Linear, right: Linear, op: ast.cmpop) -> Constraint:
    """One comparison of two sides."""
    if isinstance(op, ast.GtE | ast.Gt):
        left, right = right, left
    elif not isinstance(op, ast.LtE | ast.Lt):
        raise CalibratorError(f"{where} does not compare with <= or >=: {EXAMPLE}")
    less = {n: left.get(n, 0.0) - right.get(n, 0.0) for n in (left | right)}
    bound = -less.pop("", 0.0)
    kept = {name: factor for name, factor in less.items() if factor != 0}
    if not kept:
        raise CalibratorError(f"{where} names no calibrated parameter: {EXAMPLE}")
    if not np.isfinite([bound, *kept.values()]).all():
        raise CalibratorError(f"{where} has a number that is not finite: {EXAMPLE}")
    return Constraint(text, tuple(kept), tuple(kept.values()), bound)


def _linear(
    node: ast.expr, where: str, calibrated: Sequence[str], fixed: Mapping[str, float]
) -> Linear:
    """One side of a comparison; CalibratorError where it is not linear."""
    if isinstance(node, ast.Constant) and type(value := node.value) in (int, float):
        assert isinstance(value, int | float)
        return {"": float(min(value, LARGEST))}
    if isinstance(node, ast.Name):
        return _named(node.id, where, calibrated, fixed)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        sign = -1.0 if isinstance(node.op, ast.USub) else 1.0
        return _times(_linear(node.operand, where, calibrated, fixed), sign)
    if isinstance(node, ast.BinOp):
        left = _linear(node.left, where, calibrated, fixed)
        right = _linear(node.right, where, calibrated, fixed)
        if isinstance(node.op, ast.Add | ast.Sub):
            right = _times(right, -1.0) if isinstance(node.op, ast.Sub) else right
            return {n: left.get(n, 0.0) + right.get(n, 0.0) for n in (left | right)}
        if isinstance(node.op, ast.Mult) and (set(left) == {""} or set(right) == {""}):
            number, other = (left, right) if set(left) == {""} else (right, left)
            return _times(other, number[""])
        if isinstance(node.op, ast.Div) and set(right) == {""} and right[""] != 0:
            return _times(left, 1 / right[""])
    raise CalibratorError(f"{where} is not linear: {EXAMPLE}")


def _named(name: str, where: str, calibrated: Sequence[str], fixed: Mapping[str, float]) -> Linear:
    """A parameter's name as one side."""
    if name in calibrated:
        return {name: 1.0}
    if name in fixed:
        return {"": float(fixed[name])}
    raise CalibratorError(
        f"{where}: {shown(name)} is neither calibrated nor a number under [fixed]; use"
        f" {', '.join(calibrated)}"
    )


def _times(side: Linear, factor: float) -> Linear:
    return {name: factor * one for name, one in side.items()}
