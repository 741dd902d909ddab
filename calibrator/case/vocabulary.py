"""The vocabulary: every name that appears in tables, code, plots and errors.

It is read from the scripts' contract, a data file beside the YADE scripts, because the calibrator
and YADE run on different Pythons and never import each other.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

from calibrator.files import beside

SCRIPTS = beside("yade_scripts")
_CONTRACT = json.loads((SCRIPTS / "contract.json").read_text())
SCHEMA: int = _CONTRACT["schema"]
SETUPS: tuple[str, ...] = tuple(_CONTRACT["setups"])
STATUSES: dict[str, str] = _CONTRACT["statuses"]
PLAIN_UNITS = ("token", "integer", "sizes")
"""Of parameters that are no quantities: words, whole numbers, lists of sizes."""
DIAGNOSTICS: dict[str, str] = _CONTRACT["diagnostics"]


@dataclass(frozen=True)
class Effect:
    """A physical effect that a model may lack, and that one parameter switches on.

    called : its name in words; sign : "+" or "+-", the signs that its parameter may take; scale : a
    plausible size in the parameter's unit; removed_by : what would remove it in the laboratory,
    empty where nothing does; aliases : parameters that it is mistaken for; excludes : effects that
    the scripts cannot combine it with.
    """

    called: str
    sign: str
    scale: float
    removed_by: str
    aliases: tuple[str, ...]
    excludes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Quantity:
    """A parameter or a response: its name, symbol, SI unit, meaning and the set-ups that know it.

    default and choices are None for responses (choices also for numbers); low and high of a
    response are what is physically possible, None where nothing bounds it; repeats names the
    response of the same run that it is a function of; procedure : whether it says how a run is
    made, and nothing of a vessel, although not every set-up has it; effect is None for all that is
    not the switch of one. A request does not mention an effect, or an optional parameter, that is
    at its default, so that it stays the same run when such are added.
    """

    name: str
    symbol: str
    unit: str
    about: str
    setups: tuple[str, ...]
    default: float | int | str | None = None
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] | None = None
    effect: Effect | None = None
    optional: bool = False
    procedure: bool = False
    repeats: str | None = None

    @property
    def of_a_vessel(self) -> bool:
        """Whether it is a measure of one set-up's vessel, for which no default can stand."""
        return len(self.setups) < len(SETUPS) and not self.procedure

    @property
    def excludes(self) -> tuple[str, ...]:
        """Parameters that the scripts cannot combine it with; empty where it is no effect."""
        return self.effect.excludes if self.effect else ()

    @property
    def unmentioned(self) -> bool:
        """Whether a request leaves it out at its default."""
        return self.effect is not None or self.optional

    @property
    def label(self) -> str:
        """Axis label: words, and the unit where there is one."""
        words = self.name.removesuffix("_deg").replace("_", " ")
        return words if self.unit in ("1", *PLAIN_UNITS) else f"{words} [{self.unit}]"


def _read(section: str) -> dict[str, Quantity]:
    """The quantities of one section of the contract by name."""
    quantities = {}
    for name, spec in _CONTRACT[section].items():
        spec = dict(spec, setups=tuple(spec.get("setups", SETUPS)))
        if "choices" in spec:
            spec["choices"] = tuple(spec["choices"])
        if "effect" in spec:
            lists = {key: tuple(spec["effect"].get(key, ())) for key in ("aliases", "excludes")}
            spec["effect"] = Effect(**{**spec["effect"], **lists})
        quantities[name] = Quantity(name=name, **spec)
    return quantities


PARAMETERS: dict[str, Quantity] = _read("parameters")
RESPONSES: dict[str, Quantity] = _read("responses")

ACROSS: dict[str, dict[str, str]] = {
    "passed_mass": {"hourglass": "time"},
    "profile_height": {
        "hourglass": "profile_radius",
        "ledge": "profile_x",
        "conical_pile": "profile_radius",
        "rotating_drum": "profile_x",
    },
}
"""Of each curve that can be a target, the array that it runs over, by set-up.

They are arrays that the set-ups' scripts leave beside a record.
"""
OPEN_ENDED = (("passed_mass", "hourglass"), ("profile_height", "conical_pile"))
"""Curves that no wall ends: beyond its last point such a curve goes on as it ends."""

CURVES: dict[str, Quantity] = {
    name: Quantity(name, symbol, unit, about, tuple(ACROSS[name]))
    for name, symbol, unit, about in (
        ("passed_mass", "M(t)", "kg", "mass that has passed the neck over the time [s]"),
        ("profile_height", "h(x)", "m", "height of the surface over the position [m]"),
    )
}
"""Curves that a run leaves and a laboratory can measure."""

MOST_COMPONENTS = 6
DIFFERENCE = "difference"
COMPONENTS: dict[str, Quantity] = {
    f"{name}_{part}": Quantity(f"{name}_{part}", f"{q.symbol}, {part}", q.unit, about, q.setups)
    for name, q in CURVES.items()
    for part, about in (
        *((str(i + 1), f"component {i + 1} of the {q.label}") for i in range(MOST_COMPONENTS)),
        (DIFFERENCE, f"how the measured {q.label} differs from what its components describe"),
    )
}
"""Responses that stand for a curve: by how much it goes along each of a few shapes."""

QUANTITIES: dict[str, Quantity] = {**RESPONSES, **CURVES, **COMPONENTS}
"""All that a target can be of."""


def effect_of(name: str) -> Effect:
    """What the vocabulary says of the effect that a column switches on."""
    effect = PARAMETERS[name].effect
    assert effect is not None
    return effect


EFFECTS: dict[str, Quantity] = {name: q for name, q in PARAMETERS.items() if q.effect}


def parameters_of(setup: str) -> dict[str, Quantity]:
    """The parameters that a set-up takes, in the contract's order."""
    return {name: quantity for name, quantity in PARAMETERS.items() if setup in quantity.setups}
