"""What stiffness, restitution and walls do to each response, and what frictions are worth.

    python -m benchmarks.numerics.fixed_values    some seconds; no run is made

Writes benchmarks/results/fixed_values.json, from shipped runs. Each response is a quadratic surface
in the parameters that the runs vary, by least squares, with a line for the one that is asked about:
the change that it makes, and its standard error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.common import rounded, write
from benchmarks.numerics.smallest_vessels import (
    CRATER_EQ,
    EQUIVALENT,
    FITTED,
    LEDGE,
    LEDGE_EQ,
    RESTITUTION,
    good,
    is_plain,
    number,
    records,
    scatter,
)
from calibrator.case.physics import GRAVITY
from calibrator.runs.record import Record

FRICTIONS = ("rolling_friction", "sliding_friction")
JUDGED = {
    "conical_pile": ("bulk_density", EQUIVALENT, FITTED),
    "ledge": ("bulk_density", LEDGE_EQ, LEDGE),
    "hourglass": ("bulk_density", CRATER_EQ, "mass_flow_rate"),
}
CHANGES = {"restitution": (RESTITUTION, 0.6), "wall_friction_ratio": (1.0, 0.5)}
WORTH_AT = {"smooth": (0.15, 0.3), "middle": (0.2, 0.45), "rough": (0.3, 0.55)}
STEP = 0.1  # of a friction
VESSELS = {"conical_pile": 20e-3, "hourglass": 26e-3}  # of cases/missing_effect.toml
NECK = 14e-3
Surface = tuple[Callable[[Any, Any], np.ndarray], np.ndarray]
LIFTS = (40e-3, 10e-3, 5e-3)  # [m/s], the first as in the case
BEADS = (0.1, 0.3)  # rolling and sliding friction
GLASS = 23.0  # degrees: a heap of glass beads


def quadratic(*columns: np.ndarray) -> np.ndarray:
    """Terms (n, k) of a quadratic surface in the columns (n,)."""
    terms = [np.ones_like(columns[0]), *columns]
    terms += [a * b for i, a in enumerate(columns) for b in columns[i:]]
    return np.column_stack(terms)


def regressed(terms: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of least squares and their standard errors."""
    inverse = np.linalg.pinv(terms)
    found = inverse @ values
    free = len(values) - np.linalg.matrix_rank(terms)
    spread = float(np.sum((values - terms @ found) ** 2)) / free
    return found, np.sqrt(spread * np.sum(inverse**2, axis=1))


def columns(runs: list[Record], names: tuple[str, ...]) -> list[np.ndarray]:
    """Parameters of the runs, each between 0 and 1."""
    found = []
    for name in names:
        values = np.array([number(r, name) for r in runs])
        found.append((values - values.min()) / (np.ptp(values) or 1))
    return found


def said(change: float, error: float, values: np.ndarray, response: str) -> dict[str, float]:
    """A change in degrees, or in per cent of the mean, and its standard error."""
    unit = 1.0 if response.endswith("_deg") else float(values.mean()) / 100
    return {"change": rounded(change / unit, 3), "standard_error": rounded(error / unit, 2)}


def doubled_stiffness(runs: list[Record], names: tuple[str, ...]) -> dict[str, Any]:
    """What grains twice as stiff change, at the same weight."""
    found: dict[str, Any] = {}
    for response in JUDGED["hourglass"]:
        own = good(runs, "hourglass", response)
        doublings = np.log2([stiffness(r) for r in own])
        values = np.array([r.responses[response] for r in own])
        terms = np.column_stack([quadratic(*columns(own, names)), doublings])
        coefficients, errors = regressed(terms, values)
        found[response] = said(coefficients[-1], errors[-1], values, response)
        found["stiffness"] = [rounded(float(2 ** f(doublings)), 2) for f in (np.min, np.max)]
    return found


def stiffness(run: Record) -> float:
    """Young's modulus over the weight of a layer of grains, E / (rho g d)."""
    weight = number(run, "particle_density") * GRAVITY * 2 * number(run, "particle_radius")
    return number(run, "young_modulus") / weight


def soft_pairs(runs: list[Record]) -> dict[str, Any]:
    """Grains of 5 MPa beside those of 1 MPa, in the reduced hourglass at three friction pairs."""
    found: dict[str, Any] = {}
    for response in JUDGED["hourglass"]:
        own = [
            r
            for r in good(runs, "hourglass", response)
            if number(r, "neck_diameter") == 6e-3
            and number(r, "fill_mass") < 2e-3
            and number(r, "rolling_friction") < 0.5
        ]
        pairs = sorted({(number(r, FRICTIONS[0]), number(r, FRICTIONS[1])) for r in own})
        stiff = np.array([number(r, "young_modulus") > 2e6 for r in own])
        which = np.array(
            [pairs.index((number(r, FRICTIONS[0]), number(r, FRICTIONS[1]))) for r in own]
        )
        values = np.array([r.responses[response] for r in own])
        coefficients, errors = regressed(
            np.column_stack([np.eye(len(pairs))[which], stiff]), values
        )
        found[response] = said(coefficients[-1], errors[-1], values, response)
        found["stiffness"] = sorted({rounded(stiffness(r), 2) for r in own})
    return found


def in_vessel(runs: list[Record], setup: str, response: str) -> list[Record]:
    """Runs of a set-up as it stands in cases/missing_effect.toml, without its conditions."""
    return [
        r
        for r in good(runs, setup, response)
        if setup == "ledge" or number(r, "cylinder_diameter") == VESSELS[setup]
        if setup != "hourglass" or number(r, "neck_diameter") == NECK
    ]


def changed(runs: list[Record], name: str) -> dict[str, Any]:
    """What another restitution, or other walls, change in the small set-ups."""
    usual, other = CHANGES[name]
    only, found = [r for r in runs if is_plain(r, but=name)], {}
    for setup, responses in JUDGED.items():
        for response in responses:
            own = in_vessel(only, setup, response)
            off = np.array([number(r, name) - usual for r in own])
            values = np.array([r.responses[response] for r in own])
            terms = np.column_stack([quadratic(*columns(own, FRICTIONS)), off])
            coefficients, errors = regressed(terms, values)
            found[f"{setup}.{response}"] = {
                "runs": int(np.sum(off != 0)),
                **said(
                    coefficients[-1] * (other - usual),
                    errors[-1] * abs(other - usual),
                    values,
                    response,
                ),
            }
    return found


def surface(runs: list[Record], setup: str, response: str) -> Surface:
    """The response over rolling and sliding friction, and its mean."""
    own = in_vessel(runs, setup, response)
    at = [np.array([number(r, n) for r in own]) for n in FRICTIONS]
    values = np.array([r.responses[response] for r in own])
    coefficients, _ = regressed(quadratic(*at), values)
    return (
        lambda rolling, sliding: (
            quadratic(np.atleast_1d(rolling), np.atleast_1d(sliding)) @ coefficients
        )
    ), values


def worth(runs: list[Record]) -> dict[str, Any]:
    """What a tenth more of a friction changes, in small set-ups."""
    found: dict[str, Any] = {}
    for setup, responses in JUDGED.items():
        for response in responses:
            of, values = surface(runs, setup, response)
            unit = 1.0 if response.endswith("_deg") else float(values.mean()) / 100
            found[f"{setup}.{response}"] = {
                label: {
                    "rolling_friction": rounded(float((of(r + STEP, s) - of(r, s))[0]) / unit, 2),
                    "sliding_friction": rounded(float((of(r, s + STEP) - of(r, s))[0]) / unit, 2),
                }
                for label, (r, s) in WORTH_AT.items()
            }
    return found


def glass(runs: list[Record]) -> dict[str, Any]:
    """The least sliding friction at which the small heap stands as steep as glass beads."""
    rolling, sliding = np.linspace(0.1, 0.4, 301), np.linspace(0.25, 0.65, 401)
    across, up = (a.ravel() for a in np.meshgrid(rolling, sliding))
    found = {}
    for response in (FITTED, EQUIVALENT):
        angles = surface(runs, "conical_pile", response)[0](across, up)
        steep = np.flatnonzero(angles >= GLASS)
        least = steep[np.argmin(up[steep])]
        found[response] = {
            "sliding_friction": rounded(float(up[least]), 2),
            "rolling_friction": rounded(float(across[least]), 2),
            "at_a_rolling_friction_of_0.1": rounded(float(angles[across == 0.1].max()), 3),
        }
    return {"angle": GLASS, **found}


def beads(runs: list[Record], slow: list[Record]) -> dict[str, Any]:
    """Frictions of smooth grains, found with the small heap that is lifted at 40 mm/s.

    The measured means are those of runs at BEADS, from that lift and slower ones. A friction is
    known to where chi2 rises by 3.84, over all values of the other one and within the box.
    """
    rolling, sliding = np.linspace(0.1, 0.4, 301), np.linspace(0.25, 0.65, 401)
    across, up = (a.ravel() for a in np.meshgrid(rolling, sliding))
    heaps = [*in_vessel(runs, "conical_pile", FITTED), *slow]
    measured = {
        f"{1e3 * speed:g} mm/s": [r for r in heaps if at_beads(r, speed)] for speed in LIFTS
    }
    found = {}
    for lift, laboratory in measured.items():
        for names in ((FITTED,), (EQUIVALENT,), (EQUIVALENT, "bulk_density")):
            chi2 = np.zeros_like(across)
            for name in names:
                value = float(np.mean([r.responses[name] for r in laboratory]))
                error = scatter(in_vessel(runs, "conical_pile", name), name) * math.sqrt(2 / 5)
                chi2 += ((surface(runs, "conical_pile", name)[0](across, up) - value) / error) ** 2
            near, best = chi2 < chi2.min() + 3.84, int(np.argmin(chi2))
            found[f"{lift}: {' and '.join(names)}"] = {
                friction: [rounded(float(x), 2) for x in (at[best], at[near].min(), at[near].max())]
                for friction, at in zip(FRICTIONS, (across, up), strict=True)
            }
    return found


def at_beads(run: Record, speed: float) -> bool:
    """Whether a small heap has the frictions of BEADS and this speed of the lift [m/s]."""
    own = tuple(number(run, n) for n in (*FRICTIONS, "cylinder_diameter", "lift_speed"))
    return own == (*BEADS, VESSELS["conical_pile"], speed)


def main() -> None:
    """Look at every shipped run."""
    small = records("missing_effect", "heap_step", "versions")
    plain = [r for r in small if is_plain(r)]
    quartz = (*FRICTIONS, "particle_radius", "particle_density")
    write(
        "fixed_values",
        {
            "doubled_stiffness": {
                "coarse sand": doubled_stiffness(records("coarse_sand"), FRICTIONS),
                "quartz sand": doubled_stiffness(records("quartz_sand_reduced"), quartz),
            },
            "1 to 5 MPa": soft_pairs(records("hourglass_scale")),
            **{name: changed(small, name) for name in CHANGES},
            "worth": worth(plain),
            "glass": glass(plain),
            "beads": beads(plain, good(records("small_vessels"), "conical_pile", FITTED)),
        },
    )


if __name__ == "__main__":
    main()
