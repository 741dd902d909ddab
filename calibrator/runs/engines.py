"""The engines by name, as `--engine` gives it."""

from __future__ import annotations

from collections.abc import Callable

from calibrator.case.case import Case
from calibrator.runs.engine import Engine
from calibrator.runs.local import Local
from calibrator.runs.slurm import Slurm

ENGINES: dict[str, Callable[[Case], Engine]] = {
    "local": lambda case: Local(case.run.jobs, case.run.yade),
    "slurm": lambda case: Slurm(case.cluster, case.run.yade),
}
