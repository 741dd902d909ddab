"""Responses of another engine's grains, scanned by the code that measures YADE's.

What each set-up's script does with its grains is done here with centres and radii alone: rows of
x, y, z, and of the radius where grains have several sizes [m].
"""

import math

import numpy as np

import benchmarks.runs.liggghts_hourglass  # noqa: F401 - it puts the scripts' folder on the path

import measure  # isort: skip


def grain_mass(p: dict) -> float:
    """Mass of a grain [kg]."""
    return 4 / 3 * math.pi * p["particle_radius"] ** 3 * p["particle_density"]


def mean_grain_mass(p: dict) -> float:
    """Mean mass [kg] of grains of several sizes; see yade_scripts/material.py."""
    return grain_mass(p) * (1 + 3 * p.get("size_spread", 0.0) ** 2)


def radii(p: dict, grains: np.ndarray) -> float | np.ndarray:
    """Radius [m] of the grains: one number where the rows have none."""
    return grains[:, 3] if grains.shape[1] > 3 else float(p["particle_radius"])


def mass_of(p: dict, grains: np.ndarray) -> float:
    """Mass [kg] of all grains."""
    if grains.shape[1] == 3:
        return len(grains) * grain_mass(p)
    return float(4 / 3 * math.pi * p["particle_density"] * (grains[:, 3] ** 3).sum())


def passed(left: np.ndarray, dt: float, p: dict, filled: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] since the release and masses [kg] passed, from rows of step and grains left."""
    rows = left[np.concatenate([[True], np.diff(left[:, 0]) > 0])]
    return (rows[:, 0] - rows[0, 0]) * dt, (filled - rows[:, 1]) * grain_mass(p)


def responses(
    setup: str, p: dict, filled: np.ndarray, final: np.ndarray, curve: tuple | None
) -> tuple[str, dict]:
    """Status and responses, scanned as in yade_scripts.

    filled, final : grains (n, 3) or (n, 4) [m]; curve : times [s] and masses [kg] of a discharge.
    """
    measured = {"conical_pile": of_pile, "ledge": of_ledge, "hourglass": of_hourglass}[setup]
    status, found = measured(p, filled, final, *([curve] if setup == "hourglass" else []))
    return status, {name: float(value) for name, value in found.items() if value is not None}


def of_pile(p: dict, filled: np.ndarray, final: np.ndarray) -> tuple[str, dict]:
    """yade_scripts/conical_pile.py"""
    r, cylinder = p["particle_radius"], p["cylinder_diameter"] / 2
    x, y, height = measure.height_map(filled[:, :3], radii(p, filled), cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    volume = np.pi * cylinder**2 * height[section].mean()
    half = 1.2 * float(np.quantile(np.hypot(final[:, 0], final[:, 1]), 0.98)) + 2 * r
    x, y, height = measure.height_map(final[:, :3], radii(p, final), half, half)
    profile = measure.radial_profile(x, y, height, r)

    def flank(position, profile):
        return measure.between_heights(position, profile, 0.2, 0.8)

    found = {
        "bulk_density": mass_of(p, filled) / float(volume),
        "pile_equivalent_angle_deg": measure.cone_angle_from_moments(x, y, height),
    }
    if fit := measure.fit_slope(*flank(*profile)):
        everywhere = np.ones_like(height, bool)
        found |= {
            "pile_angle_of_repose_deg": fit["angle"],
            "pile_curvature": fit["curvature"],
            "pile_apex_rounding": fit["intercept"] - float(profile[1].max()),
            "pile_asymmetry_deg": measure.asymmetry(x, y, height, r, everywhere, flank),
        }
    return "ok", found


def of_ledge(p: dict, filled: np.ndarray, final: np.ndarray) -> tuple[str, dict]:
    """yade_scripts/ledge.py; here y begins at one side of the period."""
    r, length, width = p["particle_radius"], p["box_length"], p["box_width"]

    def scan(grains):
        centres = grains[:, :3].copy()
        centres[:, 1] = np.mod(centres[:, 1], width) - width / 2
        return measure.height_map(
            centres - (length / 2, 0, 0), radii(p, grains), length / 2, width / 2, period_y=width
        )

    final = final[final[:, 2] > -2 * r]
    density = mass_of(p, filled) / (scan(filled)[2].mean() * length * width)
    x, _, height = scan(final)
    profile = measure.x_profile(x + length / 2, height, r)
    fit = measure.fit_slope(*measure.between_heights(*profile, 0.2, 0.9))
    volume = mass_of(p, final) / density
    found = {
        "bulk_density": density,
        "residual_fraction": mass_of(p, final) / mass_of(p, filled),
        "ledge_equivalent_angle_deg": measure.wedge_angle_from_volume(volume, length, width),
    }
    if fit:
        found |= {"ledge_angle_of_repose_deg": fit["angle"], "ledge_curvature": fit["curvature"]}
    return "ok", found


def of_hourglass(p: dict, filled: np.ndarray, final: np.ndarray, curve: tuple) -> tuple[str, dict]:
    """yade_scripts/hourglass.py"""
    cylinder, neck = p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    x, y, height = measure.height_map(filled[:, :3], radii(p, filled), cylinder, cylinder)
    section = np.hypot(x[:, None], y[None, :]) < cylinder
    share = np.pi * cylinder**2 / (section.sum() * (x[1] - x[0]) * (y[1] - y[0]))
    density = mass_of(p, filled) / (measure.filled_volume(x, y, height, section) * share)
    found = {"bulk_density": density}
    final = final[final[:, 2] >= 0]
    true_neck = neck + p.get("neck_error", 0.0) / 2
    if np.any(np.hypot(final[:, 0], final[:, 1]) < 0.5 * true_neck):
        return "clogged", found
    volume = mass_of(p, final) / density
    found["residual_fraction"] = mass_of(p, final) / mass_of(p, filled)
    found["drained_equivalent_angle_deg"] = measure.crater_angle_from_volume(volume, cylinder, neck)
    return "ok", {**found, **measure.discharge_features(*curve), **of_crater(p, final)}


def of_crater(p: dict, final: np.ndarray) -> dict:
    """Angle, curvature and asymmetry of the drained slope, as in yade_scripts/hourglass.py."""
    r, cylinder, neck = p["particle_radius"], p["cylinder_diameter"] / 2, p["neck_diameter"] / 2
    x, y, height = measure.height_map(final[:, :3], radii(p, final), cylinder, cylinder)
    rho = np.hypot(x[:, None], y[None, :])
    part = (rho > neck + 2 * r) & (rho < cylinder - 2 * r)
    fit = measure.fit_slope(*measure.radial_profile(x, y, height, r / 2, part), rising=True)
    if not fit:
        return {}
    return {
        "drained_angle_of_repose_deg": fit["angle"],
        "drained_curvature": fit["curvature"],
        "drained_asymmetry_deg": measure.asymmetry(x, y, height, r / 2, part, rising=True),
    }
