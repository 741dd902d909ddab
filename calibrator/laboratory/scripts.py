"""The scripts' own measurements: what measures a simulation measures the laboratory's raw data.

`yade_scripts/measure.py` is plain numpy and part of the contract between the two Pythons. It is
loaded as a file, under a name of its own: the scripts' folder never comes onto the path, where its
`contract` or `session` could be found by accident.
"""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

from calibrator.case.vocabulary import SCRIPTS

_NAME = "calibrator_yade_measure"


def scripts_measure() -> ModuleType:
    """The module yade_scripts/measure.py."""
    if _NAME not in sys.modules:
        spec = importlib.util.spec_from_file_location(_NAME, SCRIPTS / "measure.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules[_NAME] = module
    return sys.modules[_NAME]
