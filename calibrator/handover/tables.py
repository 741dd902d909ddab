"""The material as tables of values for engines that are not run here: MercuryDPM and EDEM.

What their names mean was read in MercuryDPM's sources (HertzianViscoelasticInteraction,
MindlinInteraction, MindlinRollingTorsionInteraction) and in EDEM's manual (Hertz-Mindlin (no slip),
Standard, RVD and Type C rolling friction); no run of either was compared with YADE's.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

from calibrator.handover.chosen import Chosen
from calibrator.handover.contact import (
    effective_modulus,
    effective_shear_modulus,
    shear_modulus,
    yade_step,
)
from calibrator.handover.wording import commented, head

Row = tuple[str, float, str, str]
"""Name in the engine, value, unit, meaning."""

NOT_RUN = (
    "What the names mean was read in {where}. No run of {engine} was compared with YADE's: try a"
    " test of the calibration first."
)


def mercury(chosen: Chosen) -> str:
    """The table for MercuryDPM."""
    where = "MercuryDPM's sources (Kernel/Interactions)"
    more = [
        NOT_RUN.format(where=where, engine="MercuryDPM"),
        "Species: HertzianViscoelasticMindlinRollingTorsionSpecies; walls are of the same species,"
        " or of a second one with a mixed species.",
        "Its shear spring is 2/3 of 8 G* sqrt(R_eff delta), the calibration's the whole of it.",
        "",
    ]
    return _table(chosen, "mercury", more, _mercury_rows(chosen.numbers))


def _mercury_rows(p: dict[str, float]) -> Iterable[Row]:
    """Names of the setters of a species."""
    mu_r, mu_s = p["rolling_friction"], p["sliding_friction"]
    e_star = (
        "E* = E/(2 (1 - nu^2)), of two equal materials: first argument of"
        " setEffectiveElasticModulusAndRestitutionCoefficient"
    )
    yield "setDensity", p["particle_density"], "kg/m3", "density of a grain"
    yield "particle radius", p["particle_radius"], "m", "setRadius of each particle"
    yield "effective elastic modulus", effective_modulus(p), "Pa", e_star
    yield "restitution coefficient", p["restitution"], "1", "second argument of the same"
    g_star = "G* = G/(2 (2 - nu)) with G = E/(2 (1 + nu))"
    yield "setEffectiveShearModulus", effective_shear_modulus(p), "Pa", g_star
    yield "setSlidingFrictionCoefficient", mu_s, "1", "mu_s, between grains"
    walls = "mu_s of a grain with a wall (mixed species)"
    yield "setSlidingFrictionCoefficient", p["wall_friction_ratio"] * mu_s, "1", walls
    half = (
        "mu_r/2, between grains and at walls: MercuryDPM caps the rolling moment at 2 R_eff times"
        " this times |F_n|"
    )
    yield "setRollingFrictionCoefficient", mu_r / 2, "1", half
    stiffness = (
        "not a setting: MercuryDPM's rolling spring is 4 k_t R_eff^2 under the load of the moment;"
        " the value is the calibration's ratio, under five grain weights"
    )
    yield "rolling stiffness over k_t R_eff^2", p["rolling_stiffness_ratio"], "1", stiffness
    yield "setRollingDissipation", 0.0, "1", "YADE's rolling spring has no dashpot"
    yield "setTorsionFrictionCoefficient", 0.0, "1", "no resistance to twist"
    yield "setTimeStep", yade_step(p), "s", "that of the YADE runs"


def edem(chosen: Chosen) -> str:
    """The table for EDEM."""
    more = [
        NOT_RUN.format(where="Altair's manual of EDEM", engine="EDEM"),
        "Physics: Hertz-Mindlin (no slip). The coefficient of rolling friction is another number in"
        " each of EDEM's rolling models: take one row of the last three pairs only.",
        "",
    ]
    return _table(chosen, "edem", more, _edem_rows(chosen.numbers))


def _edem_rows(p: dict[str, float]) -> Iterable[Row]:
    """Names of EDEM's Creator."""
    mu_r, mu_s = p["rolling_friction"], p["sliding_friction"]
    yield "Solids Density", p["particle_density"], "kg/m3", "density of a grain"
    yield "Particle radius", p["particle_radius"], "m", "single sphere"
    yield "Poisson's Ratio", p["poisson_ratio"], "1", "grains and geometry"
    yield "Young's Modulus", p["young_modulus"], "Pa", "grains and geometry, not reduced"
    shear = "G = E/(2 (1 + nu)), where EDEM asks for it instead of Young's modulus"
    yield "Shear Modulus", shear_modulus(p), "Pa", shear
    yield "Coefficient of Restitution", p["restitution"], "1", "all pairs"
    yield "Coefficient of Static Friction", mu_s, "1", "grain with grain"
    walls = p["wall_friction_ratio"] * mu_s
    yield "Coefficient of Static Friction", walls, "1", "grain with geometry"
    name = "Coefficient of Rolling Friction"
    standard = (
        "Standard rolling friction, grain with grain: its torque is the coefficient times |F_n|"
        " times the distance to the grain's centre, so mu_r/2 for equal grains; no spring, so that"
        " it holds no grain at rest by itself"
    )
    yield name, mu_r / 2, "1", standard
    yield name, mu_r, "1", "Standard rolling friction, grain with geometry: the distance is R"
    rvd = "RVD rolling friction, {}: torque mu_r R* |F_n|; no spring"
    yield name, mu_r, "1", rvd.format("grain with grain")
    yield name, mu_r, "1", rvd.format("grain with geometry")
    kind_c = (
        "Type C rolling friction, {}: capped at mu_r R_r |F_n|, with R_r the equivalent rolling"
        " radius, taken as R_i R_j/(R_i + R_j) (Ai et al., 2011); its spring is the soft one,"
        " 2.25 k_n mu_r^2 R_r^2, which makes flatter heaps than the stiff one; damping ratio 0"
    )
    yield name, mu_r, "1", kind_c.format("grain with grain")
    yield name, mu_r, "1", kind_c.format("grain with geometry")
    yield "Fixed Time Step", yade_step(p), "s", "that of the YADE runs"


def _table(chosen: Chosen, engine: str, more: list[str], rows: Iterable[Row]) -> str:
    """A CSV whose head is comments."""
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(["name", "value", "unit", "meaning"])
    for name, value, unit, meaning in rows:
        table.writerow([name, f"{value:.10g}", unit, meaning])
    return "\n".join(commented(head(chosen, engine, more))) + "\n" + stream.getvalue()
