"""Responses of another engine's grains, scanned by the code that measures YADE's.

What each set-up's script does with its grains is done here with centres alone.
"""

import math

import numpy as np

import benchmarks.runs.liggghts_hourglass  # noqa: F401 - it puts the scripts' folder on the path

import measure  # isort: skip


def grain_mass(p: dict) -> float:
    """Mass of a grain [kg]."""
    return 4 / 3 * math.pi * p["particle_radius"] ** 3 * p["particle_density"]


def passed(left: np.ndarray, dt: float, p: dict, filled: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] since the release and masses [kg] passed, from rows of step and grains left."""
    rows = left[np.concatenate([[True], np.diff(left[:, 0]) > 0])]
    return (rows[:, 0] - rows[0, 0]) * dt, (filled - rows[:, 1]) * grain_mass(p)


def responses(
    setup: str, p: dict, filled: np.ndarray, final: np.ndarray, curve: tuple | None
) -> tuple[str, dict]:
    """Status and responses, scanned as in yade_scripts.

    filled, final : centres (n, 3) [m]; curve : times [s] and masses [kg] of a discharge.
    """
    measured = {"conical_pile": of_pile, "ledge": of_ledge, "hourglass": of_hourglass}[setup]
    return measured(p, filled, final, *([curve] if setup == "hourglass" else []))


def of_pile(p: dict, filled: np.ndarray, final: np.ndarray) -> tuple[str, dict]:
    """yade_scripts/conical_pile.py"""
    r, cylinder = p["particle_radius"], p["cylinder_diameter"] / 2
    x, y, height = measure.height_map(filled, r, cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    volume = np.pi * cylinder**2 * height[section].mean()
    half = 1.2 * float(np.quantile(np.hypot(final[:, 0], final[:, 1]), 0.98)) + 2 * r
    x, y, height = measure.height_map(final, r, half, half)
    profile = measure.radial_profile(x, y, height, r)
    fit = measure.fit_slope(*measure.between_heights(*profile, 0.2, 0.8))
    return "ok", {
        "bulk_density": len(filled) * grain_mass(p) / float(volume),
        "pile_equivalent_angle_deg": measure.cone_angle_from_moments(x, y, height),
        **({"pile_angle_of_repose_deg": fit["angle"]} if fit else {}),
    }


def of_ledge(p: dict, filled: np.ndarray, final: np.ndarray) -> tuple[str, dict]:
    """yade_scripts/ledge.py; here y begins at one side of the period."""
    r, length, width = p["particle_radius"], p["box_length"], p["box_width"]

    def scan(centres):
        centres = centres.copy()
        centres[:, 1] = np.mod(centres[:, 1], width) - width / 2
        return measure.height_map(
            centres - (length / 2, 0, 0), r, length / 2, width / 2, period_y=width
        )

    final = final[final[:, 2] > -2 * r]
    density = len(filled) * grain_mass(p) / (scan(filled)[2].mean() * length * width)
    x, _, height = scan(final)
    profile = measure.x_profile(x + length / 2, height, r)
    fit = measure.fit_slope(*measure.between_heights(*profile, 0.2, 0.9))
    volume = len(final) * grain_mass(p) / density
    return "ok", {
        "bulk_density": float(density),
        "residual_fraction": len(final) / len(filled),
        "ledge_equivalent_angle_deg": measure.wedge_angle_from_volume(volume, length, width),
        **({"ledge_angle_of_repose_deg": fit["angle"]} if fit else {}),
    }


def of_hourglass(p: dict, filled: np.ndarray, final: np.ndarray, curve: tuple) -> tuple[str, dict]:
    """yade_scripts/hourglass.py"""
    r, cylinder, neck = p["particle_radius"], p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    x, y, height = measure.height_map(filled, r, cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    share = np.pi * cylinder**2 / (section.sum() * (x[1] - x[0]) * (y[1] - y[0]))
    density = len(filled) * grain_mass(p) / (measure.filled_volume(x, y, height, section) * share)
    found = {"bulk_density": density}
    final = final[final[:, 2] >= 0]
    if np.any(np.hypot(final[:, 0], final[:, 1]) < 0.5 * neck):
        return "clogged", found
    volume = len(final) * grain_mass(p) / density
    found["residual_fraction"] = len(final) / len(filled)
    found["drained_equivalent_angle_deg"] = measure.crater_angle_from_volume(volume, cylinder, neck)
    return "ok", {**found, **measure.discharge_features(*curve)}
