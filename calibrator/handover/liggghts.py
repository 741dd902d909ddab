"""The material as an input file for LIGGGHTS, to be included once the box is there."""

from __future__ import annotations

from calibrator.handover.chosen import Chosen
from calibrator.handover.contact import liggghts_step
from calibrator.handover.measured import sentences
from calibrator.handover.wording import commented, head, wrapped

SOFT, HARD = 5e6, 1e9
"""[Pa]: below and above, LIGGGHTS refuses a Young's modulus unless it is told that it is meant."""

STEP = {
    False: "a fifth of the Rayleigh time, as in the comparison above; YADE's own is longer",
    True: "as the case fixes it",
}
"""What the time step is, by whether the case fixes it."""

MAPPING = """How it maps:
- pair gran hertz with tangential history is the Hertz-Mindlin law of the calibration, with
  R_eff = R at walls; restitution is the coefficient, and not YADE's damping ratio betan.
- rolling_friction {model}: the moment is capped at mu_r R_eff |F_n|, between grains and at walls,
  so coefficientRollingFriction is mu_r itself. YADE's eta is another number (mu_r / 2 for equal
  grains) and must not be put here. YADE's spring is a constant, this one follows the load.
- Type 1 are grains, type 2 walls, of the same elasticity.
- The shear force is k_t times the displacement here, a sum of increments in YADE: one of the
  reasons why bulk responses differ a little.

Measured at equal parameters, YADE minus LIGGGHTS:
{measured}

To be set before the box is made:
    units si
    atom_style granular
    boundary f f f
    newton off
    communicate single vel yes
    create_box 2 ...            (two types; or read_data of a file with two types)
Then: include {stem}.liggghts
Then walls, with the variables of this file, such as a floor and a mesh:
    fix base all wall/gran ${{law}} primitive type ${{wall}} zplane 0.0
    fix vessel all mesh/surface file vessel.stl type ${{wall}}
    fix sides all wall/gran ${{law}} mesh n_meshes 1 meshes vessel
and grains of type ${{grain}} with radius ${{radius}} and density ${{density}}, gravity, and
    fix motion all nve/sphere
"""


def text(chosen: Chosen) -> str:
    """The file."""
    p = chosen.numbers
    model = str(chosen.values["rolling_spring"])
    measured = "\n".join(f"  {line}" for line in sentences("LIGGGHTS", _ratio(chosen)))
    if model == "epsd":
        measured = "  nothing with the soft spring epsd"
    mapping = MAPPING.format(model=model, measured=measured, stem=chosen.stem).splitlines()
    mu, ratio = p["sliding_friction"], p["wall_friction_ratio"]
    rows = [
        ("youngsModulus", "peratomtype", [p["young_modulus"]] * 2, "[Pa], not reduced"),
        ("poissonsRatio", "peratomtype", [p["poisson_ratio"]] * 2, ""),
        ("coefficientRestitution", "peratomtypepair 2", [p["restitution"]] * 4, ""),
        ("coefficientFriction", "peratomtypepair 2", [mu, *[ratio * mu] * 3], "mu_s; at walls"),
        ("coefficientRollingFriction", "peratomtypepair 2", [p["rolling_friction"]] * 4, "mu_r"),
    ]
    if model == "epsd":  # without its dashpot, which YADE's spring has not either
        rows.append(("coefficientRollingViscousDamping", "peratomtypepair 2", [0.0] * 4, ""))
    lines = commented(wrapped(head(chosen, "liggghts", mapping)))
    lines += [
        "",
        f'variable law string "model hertz tangential history rolling_friction {model}"',
        "variable grain equal 1",
        "variable wall equal 2",
        f"variable radius equal {p['particle_radius']:.10g}   # [m]",
        f"variable density equal {p['particle_density']:.10g}   # [kg/m3], of a grain",
        "",
        *_modulus(p["young_modulus"]),
    ]
    for i, (name, kind, values, about) in enumerate(rows, 1):
        numbers = " ".join(f"{value:.10g}" for value in values)
        line = f"fix material{i} all property/global {name} {kind} {numbers}"
        lines.append(f"{line}   # {about}" if about else line)
    lines += [
        "pair_style gran ${law}",
        "pair_coeff * *",
        "",
        f"# [s], {STEP[bool(p['time_step'])]}",
        f"timestep {liggghts_step(p):.10g}",
    ]
    return "\n".join(lines) + "\n"


def _ratio(chosen: Chosen) -> float:
    """The ratio of YADE's rolling spring that the comparison is looked up at."""
    return chosen.numbers["rolling_stiffness_ratio"]


def _modulus(young: float) -> list[str]:
    """The command without which LIGGGHTS takes this Young's modulus for a slip."""
    if young < SOFT:
        return ["soft_particles yes"]
    return ["hard_particles yes"] if young > HARD else []
