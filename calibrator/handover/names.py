"""The engines that a material is written for; nothing heavy, as the command line needs them."""

CALLED = {
    "yade": "YADE",
    "liggghts": "LIGGGHTS",
    "lammps": "LAMMPS",
    "mercury": "MercuryDPM",
    "edem": "EDEM",
}
"""How they are called, by the names that the command takes."""

ENGINES = tuple(CALLED)
