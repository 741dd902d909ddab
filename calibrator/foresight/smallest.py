"""How large a vessel has to be for what is measured in it, by the project's own runs.

`LEAST` is the table of docs/own_measurement.md, and what `check` warns by. The runs behind it:
`python -m benchmarks.numerics.smallest_vessels`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from calibrator.case.case import Case
from calibrator.case.experiment import parts_of
from calibrator.case.lab import Observable
from calibrator.case.physics import GRAVITY, floored
from calibrator.foresight.values import Values, corners
from calibrator.plan.requests import make_request
from calibrator.runs import setups
from calibrator.runs.cost import core_seconds
from calibrator.runs.request import Request

ROUGH = {"rolling_friction": 0.3, "sliding_friction": 0.45}
"""Frictions from which on grains arch over necks that others pass."""


@dataclass(frozen=True)
class Least:
    """How large something has to be for a response.

    Attributes
    ----------
    what : in words, short : in fewer, with a verb, setups : that have it, responses : that need it.
    least : the smallest value that is not warned of, in its unit; of a speed it is the largest.
    seen : what the shipped runs show below it.
    instead : what else to do than to build it larger.
    """

    what: str
    short: str
    setups: tuple[str, ...]
    responses: tuple[str, ...]
    least: float
    unit: str
    seen: str
    instead: str


PILE = ("pile_angle_of_repose_deg", "pile_equivalent_angle_deg")
FLOW = ("mass_flow_rate", "discharge_time", "emptying_time", "drained_equivalent_angle_deg")
LEAST = {
    "heap": Least(
        "height of a heap",
        "such a heap is",
        ("conical_pile",),
        PILE,
        8,
        "grain diameters high",
        "the fitted angle lies 5.7 degrees below to 3.5 above the equivalent one (from 8 up within"
        " 1), and heaps of the same grains stand 1.8 degrees flatter at 6 high than at 12",
        "give the equivalent angle, of a heap that was as small in the laboratory",
    ),
    "lift": Least(
        "speed of a lifted cylinder, at most",
        "the lift has",
        ("conical_pile",),
        PILE,
        0.04,
        "sqrt(g d)",
        "the same smooth grains stood at 10 degrees from a lift at 0.29, at 15 from one at 0.071"
        " and at 22 from one at 0.036, rough ones at 24 from 0.29 and at 32 from 0.071",
        "measure how fast the laboratory lifts, to a tenth, and give that",
    ),
    "ledge": Least(
        "length of a ledge",
        "the ledge has",
        ("ledge",),
        ("ledge_angle_of_repose_deg",),
        20,
        "grain diameters",
        "a fitted slope scatters by 2.2 degrees between runs at 12 and by 1.9 at 15, the"
        " equivalent angle by 0.9 and 0.6",
        "give the residual mass or the equivalent angle",
    ),
    "crater": Least(
        "slope of a crater, from the neck to the wall",
        "the slope has",
        ("hourglass",),
        ("drained_angle_of_repose_deg",),
        16,
        "grain diameters",
        "a fitted slope of 3 to 6 lies 13 to 34 degrees below the equivalent angle and scatters by"
        " 3 to 8 between runs, the equivalent angle by 1",
        "give the residual mass or the equivalent angle",
    ),
    "neck": Least(
        "neck",
        "the neck has",
        ("hourglass",),
        FLOW,
        7,
        "grain diameters",
        "6 of 20 runs clogged at 6.25",
        "expect clogged runs",
    ),
    "rough neck": Least(
        "neck, where the bounds go beyond a rolling friction of 0.3 and a sliding one of 0.45",
        "the neck has",
        ("hourglass",),
        FLOW,
        7.7,
        "grain diameters",
        "19 of 85 runs of such grains clogged from 7 to 7.7, and 1 of 71 above",
        "lower the bounds, or expect clogged runs there",
    ),
    "discharge": Least(
        "grains of an hourglass that is timed until all is at rest",
        "a run has",
        ("hourglass",),
        ("discharge_time",),
        5000,
        "grains",
        "the time to rest scatters by 14 to 29 % between runs of 811 to 4080 grains, the emptying"
        " time by 8 to 11 and the rate by 5 to 8",
        "give mass_flow_rate or emptying_time",
    ),
    "width": Least(
        "cylinder that a bulk density is measured in",
        "the cylinder has",
        ("hourglass", "conical_pile"),
        ("bulk_density",),
        15,
        "grain diameters",
        "the same grains fill 1.4 % looser at 10 than at 20, and 0.3 % at 15",
        "measure in a vessel as narrow as that",
    ),
}


def heap_height(grains: float, angle_deg: float) -> float:
    """Height of a heap in grain diameters.

    A cone of height h and slope tan(theta) has the volume pi h^3 / (3 tan^2); N grains of diameter
    d, packed at phi, fill N pi d^3 / (6 phi). So h/d = (N tan^2 / (2 phi))^(1/3).

    >>> round(heap_height(1231, 23), 1)
    5.8
    """
    packed = 2 * setups.NOMINAL_FRACTION
    return float((grains * math.tan(math.radians(angle_deg)) ** 2 / packed) ** (1 / 3))


@dataclass(frozen=True)
class Vessel:
    """What of an experiment decides how large its responses are measured.

    values : of the experiment, grains : the fewest of a run, fine and coarse : diameters of the
    smallest and the largest grain [m].
    """

    values: Values
    grains: float
    fine: float
    coarse: float

    def least(self, name: str) -> float:
        """The smallest value of a parameter."""
        return self.values[name].bounds[0]


Size = tuple[float, dict[str, float]]
"""A size in the unit of its `Least`, and parameters that would make it as large as it should be."""


def small_vessels(case: Case, values: dict[str, Values]) -> list[str]:
    """A sentence for each vessel that is too small for what is measured in it.

    values : see `resolved`. Of rows with the role diagnose only clogging is said: what else they
    compare are runs and a laboratory whose vessel was as small.
    """
    found = []
    for experiment, own in values.items():
        setup = parts_of(experiment)[0]
        fewest = min(setups.SETUP_ENTRIES[setup].particles(p) for p in corners(setup, own))
        vessel = Vessel(own, fewest, *(2 * r for r in own["particle_radius"].bounds))
        for kind, size_of in SIZES.items():
            least = LEAST[kind]
            rows = [
                o
                for o in case.observables
                if o.experiment == experiment
                and o.response in least.responses
                and (o.role != "diagnose" or least.responses is FLOW)
            ]
            if rows and setup in least.setups and (size := size_of(vessel, rows)):
                keys = ", ".join(o.key for o in rows)
                found.append(f"{keys}: {_said(least, size[0])}; {_remedy(case, experiment, size)}")
                found[-1] += f", or {least.instead}"
    return found


def _said(least: Least, size: float) -> str:
    """How far a size is from what it should be, and what was seen there."""
    side = "above" if size > least.least else "below"
    number = f"{size:.0f}" if size >= 100 else f"{size:.2g}"
    return f"{least.short} {number} {least.unit}, {side} {least.least:g}: {least.seen}"


def _remedy(case: Case, experiment: str, size: Size) -> str:
    """The values to give, and what a run costs with them and without."""
    given = ", ".join(f"{name} = {value:g}" for name, value in size[1].items())
    request = make_request(case, experiment, case.problem.high, case.plan.seed)
    larger = Request(request.setup, {**request.parameters, **size[1]})
    rate = case.run.particle_steps_per_second
    now, then = core_seconds([request, larger], rate=rate).tolist()
    cost = f" ({then:.2g} core-seconds a run instead of {now:.2g})" if then > 1.2 * now else ""
    return f"give {given}{cost}"


def _up(value: float) -> float:
    """Rounded up to two digits, so that it is not warned of again."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.2g}")


def _short(kind: str, size: float) -> bool:
    """Whether a size is below the least."""
    return size < LEAST[kind].least * (1 - 1e-9)


def _heap(vessel: Vessel, rows: list[Observable]) -> Size | None:
    """A cylinder from which the measured angle makes a heap of a few grains."""
    height = min(heap_height(vessel.grains, abs(o.value)) for o in rows)
    factor = LEAST["heap"].least / max(height, 0.1)
    lengths = ("cylinder_diameter", "fill_height", "lift_height")
    larger = {name: _up(factor * vessel.least(name)) for name in lengths}
    return (height, larger) if _short("heap", height) else None


def _lift(vessel: Vessel, _: list[Observable]) -> Size | None:
    """A cylinder that is lifted so fast that the grains collapse."""
    fast, unit = vessel.values["lift_speed"].bounds[1], math.sqrt(GRAVITY * vessel.fine)
    slow = {"lift_speed": float(floored(LEAST["lift"].least * unit))}
    return (fast / unit, slow) if fast > LEAST["lift"].least * unit * (1 + 1e-9) else None


def _ledge(vessel: Vessel, _: list[Observable]) -> Size | None:
    """A short slope."""
    return _length("ledge", vessel, "box_length")


def _length(kind: str, vessel: Vessel, name: str) -> Size | None:
    """A length of few grain diameters."""
    size = vessel.least(name) / vessel.coarse
    return (size, {name: _up(LEAST[kind].least * vessel.coarse)}) if _short(kind, size) else None


def _crater(vessel: Vessel, _: list[Observable]) -> Size | None:
    """A cylinder with few grains between its neck and its wall."""
    neck, narrow = vessel.values["neck_diameter"].bounds[1], vessel.least("cylinder_diameter")
    wide = _up(neck + 2 * LEAST["crater"].least * vessel.coarse)
    larger = {
        "cylinder_diameter": wide,
        "fill_mass": _up(vessel.least("fill_mass") * (wide / narrow) ** 2),
    }
    slope = (narrow - neck) / 2 / vessel.coarse
    return (slope, larger) if _short("crater", slope) else None


def _neck(vessel: Vessel, _: list[Observable]) -> Size | None:
    """A neck that clogs."""
    return _length("neck", vessel, "neck_diameter")


def _rough_neck(vessel: Vessel, rows: list[Observable]) -> Size | None:
    """A neck over which the roughest grains of the box arch."""
    rough = all(vessel.values[name].bounds[1] > at for name, at in ROUGH.items())
    known = _neck(vessel, rows)
    return _length("rough neck", vessel, "neck_diameter") if rough and not known else None


def _discharge(vessel: Vessel, _: list[Observable]) -> Size | None:
    """An hourglass of few grains, the last of which decide when it is at rest."""
    fill = _up(vessel.least("fill_mass") * LEAST["discharge"].least / max(vessel.grains, 1))
    return (vessel.grains, {"fill_mass": fill}) if _short("discharge", vessel.grains) else None


def _width(vessel: Vessel, _: list[Observable]) -> Size | None:
    """A narrow cylinder, whose wall keeps grains apart."""
    return _length("width", vessel, "cylinder_diameter")


SIZES: dict[str, Callable[[Vessel, list[Observable]], Size | None]] = {
    "heap": _heap,
    "lift": _lift,
    "ledge": _ledge,
    "crater": _crater,
    "neck": _neck,
    "rough neck": _rough_neck,
    "discharge": _discharge,
    "width": _width,
}
