"""Materials to be exported, without a calibration behind them."""

from calibrator.case.vocabulary import PARAMETERS
from calibrator.handover.chosen import CONTACT, STEP, SWITCHES, Chosen, Standing


def material(label="compromise", **values):
    """The contract's defaults with these values, as if they had been calibrated and verified."""
    names = (*CONTACT, *STEP, *SWITCHES)
    assert set(values) <= set(names)
    return Chosen(
        case="sand",
        about="a sand for tests",
        label=label,
        values={n: values.get(n, PARAMETERS[n].default) for n in names},
        calibrated=("rolling_friction", "sliding_friction"),
        setups=("hourglass",),
        differing=(),
        standing=Standing(True, "verified: for tests"),
        yade=("2023.02a",),
        command="calibrator all sand.toml",
    )
