"""The material as an input file for LAMMPS, to be included once the box is there."""

from __future__ import annotations

from calibrator.handover.chosen import Chosen
from calibrator.handover.contact import rolling_spring, yade_step
from calibrator.handover.measured import sentences
from calibrator.handover.wording import commented, head, wrapped

MAPPING = """For LAMMPS of 2022 or later; tried with that of 22 Jul 2025. That of 29 Sep 2021 does
not know damping coeff_restitution.

How it maps:
- hertz/material with damping coeff_restitution: E, e, nu of the material; LAMMPS forms E*
  itself, and takes R_eff = R at walls.
- tangential mindlin/force: a sum of k_t times increments of the displacement, as in YADE. NULL
  takes k_t from E and nu, and 1.0 the normal damping for the shear.
- rolling sds: the moment is capped at mu_r R_eff |F_n|, so the last number is mu_r itself.
  YADE's eta is another number (mu_r / 2 for equal grains) and must not be put here. The first
  number is the rolling stiffness over R_eff^2 [N/m], a constant as in YADE: {ratio}
  under five grain weights, another one at walls because R_eff is. The second, its dashpot, is
  0: YADE has none.
- No twisting.

Measured at equal parameters and springs, YADE minus LAMMPS:
{measured}
  Ledges and discharge were not compared.

To be set before the box is made:
    units si
    atom_style sphere
    boundary f f f
    newton off
    comm_modify vel yes
    create_box 1 ...            (or read_data)
Then: include {stem}.lammps
Then walls, with the variable of this file, such as a floor:
    fix base all wall/gran granular ${{wall_law}} zplane 0.0 NULL
and grains of diameter ${{diameter}} and density ${{density}}, gravity, and
    fix motion all nve/sphere
"""


def text(chosen: Chosen) -> str:
    """The file."""
    p = chosen.numbers
    measured = "\n".join(f"  {line}" for line in sentences("LAMMPS", p["rolling_stiffness_ratio"]))
    ratio = f"{p['rolling_stiffness_ratio']:g} k_t"
    if chosen.values["rolling_spring"] == "epsd":
        ratio = "2.25 k_n mu_r^2"
        measured = "  nothing with the soft spring epsd"
    mapping = MAPPING.format(ratio=ratio, measured=measured, stem=chosen.stem).splitlines()
    radius = p["particle_radius"]
    lines = commented(wrapped(head(chosen, "lammps", mapping)))
    walls = p["wall_friction_ratio"] * p["sliding_friction"]
    lines += [
        "",
        f'variable grain_law string "{_law(chosen, radius / 2, p["sliding_friction"])}"',
        f'variable wall_law string "{_law(chosen, radius, walls)}"',
        f"variable diameter equal {2 * radius:.10g}   # [m]",
        f"variable density equal {p['particle_density']:.10g}   # [kg/m3], of a grain",
        "",
        "pair_style granular",
        "pair_coeff * * ${grain_law}",
        "",
        "# [s], as in YADE",
        f"timestep {yade_step(p):.10g}",
    ]
    return "\n".join(lines) + "\n"


def _law(chosen: Chosen, effective_radius: float, friction: float) -> str:
    """Contact law at this R_eff [m]; without rolling resistance where mu_r is 0."""
    p = chosen.numbers
    spring = rolling_spring(p, str(chosen.values["rolling_spring"]), effective_radius)
    normal = (
        f"hertz/material {p['young_modulus']:.10g} {p['restitution']:.10g}"
        f" {p['poisson_ratio']:.10g} damping coeff_restitution"
    )
    shear = f"tangential mindlin/force NULL 1.0 {friction:.10g}"
    rolling = f" rolling sds {spring:.10g} 0.0 {p['rolling_friction']:.10g}" if spring else ""
    return f"{normal} {shear}{rolling}"
