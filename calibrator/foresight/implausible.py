"""What can be run and is hardly meant: a sentence with numbers and what to do for each."""

from __future__ import annotations

import math

import numpy as np

from calibrator.case.case import Case
from calibrator.case.experiment import parts_of
from calibrator.case.lab import Observable
from calibrator.case.physics import GRAVITY, contact_overlap
from calibrator.case.problem import Target
from calibrator.case.vocabulary import EFFECTS, PARAMETERS, RESPONSES, SETUPS
from calibrator.foresight.values import DEFAULT, Values, corners
from calibrator.plan.requests import make_request
from calibrator.responses.targets import repeats, ruling
from calibrator.runs import setups
from calibrator.runs.cost import core_seconds
from calibrator.runs.request import Request
from calibrator.runs.setup import Doubt

PERCENT_TOLERANCE = 0.5
"""A tolerance from here on is hardly meant as a share."""
STIFF = 1e9
"""Young's modulus [Pa] of solid grains: bulk responses stop changing long before."""
SOFTER = 1e7
"""Young's modulus [Pa] that the reference paper's own lower bound is near."""
DECADES = 100.0
"""Ratio of bounds that a linear scale hardly resolves."""
LARGEST_OVERLAP = 0.05
"""Of the radius."""
ANGLES = {
    *(n for n in RESPONSES if n.endswith("_deg") and not n.startswith("drum_")),
    *("residual_mass", "residual_fraction"),
}
"""Responses that tell how steeply grains rest; in a drum they flow."""
INSTEAD = {"fill_fraction": "drum_fill_mass"}
"""What a set-up does not look at where the other one is given."""
OFF = 5.0
"""Factor between a measured rate and Beverloo's estimate that is hardly a matter of friction."""


def doubts(case: Case, values: dict[str, Values]) -> list[str]:
    """Everything that is implausible; values : see `resolved`."""
    found = [*_of_parameters(case), *_of_targets(case), *_of_numbers(case)]
    for experiment, own in values.items():
        found += [f"{experiment}: {words}" for words in _of_geometry(experiment, own)]
    for one in case.observables:
        if one.experiment in values:
            found += [
                f"{one.key} = {one.value:g}: {w}" for w in _of_row(one, values[one.experiment])
            ]
    return list(dict.fromkeys([*found, *odd_materials(case, values), *_unused(case, values)]))


def _of_parameters(case: Case) -> list[str]:
    """Bounds that span decades on a linear scale, and more unknowns than measurements."""
    problem, found = case.problem, []
    for p in problem.parameters:
        if p.scale == "linear" and 0 < p.low <= p.high / DECADES * (1 + 1e-9):
            found.append(
                f"parameters.{p.name}: high is {p.high / p.low:.3g} times low on a linear scale,"
                ' which leaves hardly a set near low; set scale = "log" or narrow the bounds'
            )
    if any(t.curve for t in problem.targets):
        return found  # how much a curve says shows with the runs
    if "sliding_friction" in problem.names and all(t.response in ANGLES for t in problem.targets):
        found.append(
            "parameters.sliding_friction: every target is an angle, and a tenth more of it moves"
            " those by less than their runs scatter wherever it is above 0.45; give bulk_density or"
            " mass_flow_rate the role calibrate"
        )
    rows = repeats(problem.targets)[ruling(problem.targets)]
    unknowns, known = len(problem.parameters), len(np.unique(rows, axis=0))
    if unknowns > known:
        found.append(
            f"{unknowns} parameters for {known} independent target{'s' * (known > 1)}: they cannot"
            " all be identified, many sets will fit alike; give more rows the role calibrate, or"
            " move parameters to [fixed]"
        )
    return found


def _of_targets(case: Case) -> list[str]:
    """Tolerances in per cent, measurements without an error, and nothing held out."""
    problem, found = case.problem, []
    for t in (*problem.targets, *problem.held_out):
        if t.tolerance >= PERCENT_TOLERANCE:
            found.append(
                f"{t.key}: tolerance = {t.tolerance:g} is {t.tolerance:.0%} of the measured value;"
                f" if {t.tolerance:g} % is meant, write tolerance = {t.tolerance / 100:g}"
            )
    if once := [t.key for t in problem.targets if _unsure(t)]:
        found.append(
            f"{', '.join(once)}: no scatter is given, so the error of the measurement is"
            " unknown; give the scatter of one replicate, from repeated measurements"
        )
    if not problem.held_out:
        found.append(
            "no row is held out, so `validate` has nothing to predict: give a row of another set-up"
            " or response the role held_out"
        )
    return found


def _unsure(target: Target) -> bool:
    """Whether the error of a measurement is unknown."""
    if target.curve:
        shared = (target.curve.scale_error, target.curve.offset_error, target.curve.shift_error)
        return not any((*target.curve.scatter, *shared))
    return target.scatter == 0


def _of_numbers(case: Case) -> list[str]:
    """Single runs where several would show their scatter."""
    found = []
    if case.plan.replicates == 1 and case.plan.design != "grid":
        found.append(
            "plan.replicates = 1: the scatter of single runs stays unknown and can only be guessed"
            " from the surface; give 2 or more, for some sets with plan.replicated_sets"
        )
    first = case.plan.adaptive_start(len(case.problem.experiments))
    if case.plan.design == "adaptive" and first >= case.plan.most_runs:
        found.append(
            f"plan.most_runs = {case.plan.most_runs}: the {first} runs that an adaptive design"
            " starts with use that up before it can choose any; raise most_runs or lower sets"
        )
    if case.verify.replicates == 1:
        found.append(
            "verify.replicates = 1: a single fresh run may pass or miss by luck; give 3 or more"
        )
    return found


def _of_geometry(experiment: str, values: Values) -> list[str]:
    """The worst doubt of each kind over the corners of the box."""
    setup, worst = parts_of(experiment)[0], dict[str, Doubt]()
    for p in corners(setup, values):
        for doubt in setups.doubts(setup, p):
            if doubt.kind not in worst or doubt.badness > worst[doubt.kind].badness:
                worst[doubt.kind] = doubt
    return [doubt.sentence for doubt in worst.values()]


def _of_row(one: Observable, values: Values) -> list[str]:
    """What a measured value looks like beside the grains and the vessel."""
    found = []
    sparsest = values["particle_density"].bounds[0]
    if one.response == "bulk_density" and one.value < 0.2 * sparsest:
        found.append(
            f"only {one.value / sparsest:.2%} of the density of the grains, {sparsest:g} kg/m3; if"
            f" it is in g/cm3, or its point separates thousands, write {1000 * one.value:g}"
        )
    if one.response == "bulk_density" and one.value > 0.75 * values["particle_density"].bounds[1]:
        found.append(
            "denser than equal spheres can be packed, 74 % of the density of the grains; correct"
            " the row, or particle_density"
        )
    if one.response in ("discharge_time", "emptying_time"):
        longest = values["longest_time"].bounds[1]
        if one.value > longest:
            found.append(
                f"longer than longest_time = {longest:g} s, at which a run is given up; raise"
                " longest_time under [fixed]"
            )
    filled = values["fill_mass"].bounds[1] if "fill_mass" in values else math.inf
    if one.response == "residual_mass" and one.value > filled:
        found.append(f"more than was filled in, fill_mass = {filled:g} kg; correct one of the two")
    if one.response == "mass_flow_rate":
        found += _of_rate(one.value, values)
    return found


def _of_rate(rate: float, values: Values) -> list[str]:
    """A rate that Beverloo's law is far from."""
    middle = {n: sum(r.bounds) / 2 for n, r in values.items() if not isinstance(r.value, str)}
    neck = middle["neck_diameter"] - 3 * middle["particle_radius"]
    if neck <= 0 or rate <= 0:
        return []
    density = setups.NOMINAL_FRACTION * middle["particle_density"]
    expected = 0.58 * density * math.sqrt(GRAVITY) * neck**2.5
    if expected / OFF <= rate <= expected * OFF:
        return []
    return [
        f"Beverloo's law gives about {expected:.2g} kg/s for this neck, {rate / expected:.2g} times"
        " less; correct the unit (kg/s), the neck or the grains"
        if rate > expected
        else f"Beverloo's law gives about {expected:.2g} kg/s for this neck, {expected / rate:.2g}"
        " times more; correct the unit (kg/s), the neck or the grains"
    ]


def odd_materials(case: Case, values: dict[str, Values]) -> list[str]:
    """Grains of an odd size, weight or stiffness, which may be behind much that cannot work."""
    found = []
    own = next(iter(values.values()))
    small, large = own["particle_radius"].bounds
    light, heavy = own["particle_density"].bounds
    if large >= 0.05:
        found.append(
            f"particle_radius = {large:g} m: grains of {2e3 * large:g} mm; if mm are meant, write"
            f" {large * 1e-3:g}"
        )
    if small < 2e-5:
        found.append(
            f"particle_radius = {small:g} m: powder of {2e6 * small:.3g} micrometres, which coheres"
            " and takes very small steps; correct it, or scale the grains up"
        )
    if light < 100:
        found.append(
            f"particle_density = {light:g} kg/m3 is that of foam; if it is in g/cm3, write"
            f" {1000 * light:g}"
        )
    if heavy > 23_000:
        found.append(
            f"particle_density = {heavy:g} kg/m3 is above that of any metal; correct it, the unit"
            " is kg/m3"
        )
    softest = {n: r.bounds[0] for n, r in own.items() if not isinstance(r.value, str)}
    softest |= {"particle_radius": large, "particle_density": heavy}
    if (overlap := contact_overlap(softest) / large) > LARGEST_OVERLAP:
        found.append(
            f"young_modulus = {softest['young_modulus']:g} Pa: five grain weights press grains into"
            f" each other by {overlap:.0%} of their radius, too much for hard spheres; raise it"
        )
    return found + _of_stiffness(case, values)


def _of_stiffness(case: Case, values: dict[str, Values]) -> list[str]:
    """What grains as stiff as rock cost, and what softer ones would."""
    found = []
    for experiment in case.problem.experiments:
        stiff = values[experiment]["young_modulus"].bounds[1]
        if stiff < STIFF:
            continue
        request = make_request(case, experiment, case.problem.high, case.plan.seed)
        dear = Request(request.setup, {**request.parameters, "young_modulus": stiff})
        cheap = Request(request.setup, {**request.parameters, "young_modulus": SOFTER})
        hours = core_seconds([dear, cheap], rate=case.run.particle_steps_per_second) / 3600
        found.append(
            f"{experiment}: young_modulus = {stiff:g} Pa takes {setups.steps(dear):.2g} steps and"
            f" {hours[0]:.2g} core-hours a run, {SOFTER:g} Pa {setups.steps(cheap):.2g} and"
            f" {hours[1]:.2g}; lower it, bulk responses hardly change above {SOFTER:g} Pa"
        )
    return found


def _unused(case: Case, values: dict[str, Values]) -> list[str]:
    """Fixed values that no set-up takes, and vessels that nobody described."""
    takers = {name for own in values.values() for name in own}
    found = [
        f"fixed.{name} changes nothing: no set-up of this case takes it; remove it"
        for name in case.problem.fixed
        if name not in takers and name not in EFFECTS and not PARAMETERS[name].optional
    ]
    for experiment, own in values.items():
        idle = {n for n, other in INSTEAD.items() if n in own and other in own}
        lengths = [
            n
            for n, r in own.items()
            if r.source == DEFAULT and PARAMETERS[n].of_a_vessel and n not in idle
        ]
        found += [
            f"{experiment}: {n} changes nothing beside {INSTEAD[n]}; remove one of them"
            for n in sorted(idle)
            if own[n].source != DEFAULT
        ]
        if lengths and experiment in SETUPS:
            given = ", ".join(f"{n} = {own[n]}" for n in lengths)
            found.append(
                f"{experiment}: the case does not give {given}, the demo's vessel stands in; write"
                f" them under [setups.{experiment}]"
            )
    for name in ("sliding_friction", "rolling_friction", "particle_radius", "particle_density"):
        if any(own[name].source == DEFAULT for own in values.values()):
            one = next(own[name] for own in values.values() if own[name].source == DEFAULT)
            found.append(
                f"the case does not give {name}, the default {one} stands in; calibrate it, or"
                " write it under [fixed]"
            )
    if any(own["restitution"].source == DEFAULT for own in values.values()):
        found.append(
            "the case does not give restitution, the default 0.9 stands in: at 0.6 small heaps"
            " stand 5 degrees steeper, and fillings are 3 % looser; write it under [fixed]"
        )
    return found
