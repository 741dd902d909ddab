"""Three users: the files that they bring, and the commands that they call, mistakes included."""

from __future__ import annotations

from dataclasses import dataclass

BEADS = """name = "glass_beads"
shape = "spheres"
grain_diameter = "2 mm"
particle_density = "2.5 g/cm3"
budget = 2.5

[conical_pile]
cylinder_diameter = "50 mm"
fill_height = "60 mm"
lift_speed = "6 mm/s"

[conical_pile.measured]
pile_equivalent_angle_deg = "22.1; 23.0; 22.6 deg"
bulk_density = "1.52; 1.53; 1.525 g/cm3"
"""
"""Typed by hand, of the size that dry glass beads have; no run of ours made them."""

ORE = """name = "crushed_ore"
shape = "angular"
grain_diameter = "4-6 mm"
particle_density = "4.2 g/cm3"
budget = 3
lab = "ore_lab.csv"

[hourglass]
cylinder_diameter = "10 cm"
neck_diameter = "45 mm"
fill_mass = "2 kg"

[conical_pile]
cylinder_diameter = "90 mm"
fill_height = "90 mm"
lift_speed = "20 mm/s"
lift_height = "60 mm"
"""

PELLETS = """name = "pellets"
shape = "rounded"
grain_diameter = "1.3-1.7 mm"
particle_density = "1.5 g/cm3"
budget = 2
lab = "pellets_lab_file.csv"

[rotating_drum]
drum_diameter = "45 mm"
drum_depth = "12 mm"
rotation_rpm = "30 rpm"
"""

LOGS = ("scale_1.csv", "scale_2.csv", "scale_3.csv")
DRUM_WIDTH = "720 = 45 mm"
HEAPS = ("heap_1.png", "heap_2.png", "heap_3.png")


@dataclass(frozen=True)
class Step:
    """A command without its first word; status : that it has to end with, 2 for a refusal."""

    command: tuple[str, ...]
    status: int = 0


@dataclass(frozen=True)
class User:
    """A user.

    texts : files by name that are typed; raw : names of files in data/; steps : the commands.
    """

    about: str
    texts: dict[str, str]
    raw: tuple[str, ...]
    steps: tuple[Step, ...]


def _to_the_end(name: str) -> tuple[Step, ...]:
    """From the case to card and export."""
    case = f"{name}.toml"
    return (
        Step(("check", case)),
        Step(("all", case, "--dry-run")),
        Step(("all", case)),
        Step(("card", case, "--out", "card")),
        Step(("export", case, "--out", "export")),
    )


USERS = {
    "glass_beads": User(
        "glass beads: the angle of a heap and a bulk density",
        {"beads.toml": BEADS},
        (),
        (
            # the unit is forgotten
            Step(("init", "--answers", "beads.toml", "--set", "grain_diameter=2"), status=2),
            Step(("init", "--answers", "beads.toml")),
            *_to_the_end("glass_beads"),
        ),
    ),
    "crushed_ore": User(
        "crushed ore: the log of a scale and photographs of a heap",
        {"ore.toml": ORE},
        (*LOGS, *HEAPS),
        (
            Step(("measure", "discharge", *LOGS, "--lab", "ore_lab.csv", "--released", "2,0"), 2),
            Step(("measure", "discharge", *LOGS, "--lab", "ore_lab.csv", "--released", "2,0 s")),
            Step(
                (
                    *("measure", "photo", *HEAPS, "--known", "300 = 150 mm"),
                    *("--tilt", "6", "--grain-diameter", "5 mm", "--lab", "ore_lab.csv"),
                )
            ),
            Step(("init", "--answers", "ore.toml")),
            *_to_the_end("crushed_ore"),
        ),
    ),
    "pellets": User(
        "a powder technologist: a picture of a rotating drum, and two core-hours",
        {"pellets_answers.toml": PELLETS},
        ("drum.png",),
        (
            Step(
                (
                    *("measure", "photo", "drum.png", "--shape", "drum"),
                    *("--known", DRUM_WIDTH, "--lab", "pellets_lab_file.csv"),
                )
            ),
            # too little for any plan
            Step(("init", "--answers", "pellets_answers.toml", "--set", "budget=0.01"), 2),
            Step(("init", "--answers", "pellets_answers.toml")),
            *_to_the_end("pellets"),
        ),
    ),
}
