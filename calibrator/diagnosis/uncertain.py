"""Fixed values that the nuisance table calls uncertain, as changes of the model.

What a case fixes, such as the restitution of the grains or the width of a vessel, is an error of
the comparison where it is wrong, and one that all observables share. Runs with the value changed
say what it does to each of them, as runs with an effect do; unlike an effect it is no candidate for
what is missing.
"""

from __future__ import annotations

from calibrator.case.case import Case
from calibrator.case.lab import Nuisance
from calibrator.case.vocabulary import PARAMETERS, SETUPS, parameters_of
from calibrator.diagnosis.explanations import LARGEST, Effect
from calibrator.errors import CalibratorError

# standard errors to which an amplitude of one amounts: what a small change does drowns in the noise
WIDE = 3.0


def uncertain(case: Case) -> list[Effect]:
    """The uncertain fixed values, in the order of the nuisance table; calibrated ones are none.

    Raises CalibratorError for one that the case does not fix as a number.
    """
    return [
        _change(case, one)
        for one in case.nuisances
        if one.fixed and one.fixed[1] not in case.problem.names
    ]


def _change(case: Case, nuisance: Nuisance) -> Effect:
    assert nuisance.fixed is not None
    setup, name = nuisance.fixed
    known = [s for s in ([setup] if setup else SETUPS) if name in parameters_of(s)]
    own = case.problem.setups
    # a set-up with a value of its own is not concerned by the common one
    concerned = [s for s in known if setup or name not in own.get(s, {})]
    where = own.get(setup, {}) if setup else case.problem.fixed
    quantity = PARAMETERS[name]
    value = where.get(name, quantity.default)
    if not concerned or not isinstance(value, (int, float)) or isinstance(value, bool):
        raise CalibratorError(
            f"nuisance {nuisance.name}: the case fixes no number for {nuisance.observables};"
            " correct that row"
        )
    error = nuisance.error * abs(value) / 100 if nuisance.unit == "%" else nuisance.error
    scale = WIDE * error
    least = -LARGEST if quantity.low is None else max(-LARGEST, (quantity.low - value) / scale)
    largest = LARGEST if quantity.high is None else min(LARGEST, (quantity.high - value) / scale)
    if max(-least, largest) < 1 / WIDE:
        raise CalibratorError(
            f"nuisance {nuisance.name}: {name} = {value:g} cannot be off by {error:g}; give a"
            " smaller error"
        )
    return Effect(
        name,
        "+-",
        scale,
        min(least, 0.0),
        max(largest, 0.0),
        base=float(value),
        setups=tuple(concerned),
        nuisance=nuisance.observables,
    )
