"""How fast this machine is: a short run of YADE, timed."""

from __future__ import annotations

import tempfile
from pathlib import Path

from calibrator.errors import CalibratorError
from calibrator.runs.cost import spent_seconds
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.request import Request
from calibrator.runs.setups import particles

PROBE = Request.of(
    "conical_pile",
    cylinder_diameter=0.014,
    fill_height=0.012,
    lift_speed=0.08,
    young_modulus=1e6,
    seed=1,
)
"""A heap of 251 grains in some 13,000 steps: two to ten seconds."""


def measured_rate() -> float | None:
    """Particle-steps a second of a core of this machine; None where no run can be made here.

    That is with up to a thousand grains, as forecasts take it.

    A case cannot name the build of YADE before there is one: it is that of the environment.
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            (record,) = run(RunFolder(Path(folder)), [PROBE], jobs=1, attempts=1)
        except (CalibratorError, OSError):
            return None
    seconds = spent_seconds(record)
    if record.status != "ok" or seconds <= 0:
        return None
    return particles(PROBE) * float(record.diagnostics["steps"]) / seconds
