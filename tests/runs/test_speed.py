"""How fast the machine is, by a run of the real YADE, and what a machine without one says."""

import os
from pathlib import Path

import pytest

from calibrator.runs.cost import core_seconds
from calibrator.runs.setups import particles, steps
from calibrator.runs.speed import PROBE, measured_rate


@pytest.mark.yade
def test_a_short_run_of_yade_says_how_fast_this_machine_is():
    assert particles(PROBE) < 300 and steps(PROBE) < 20_000
    rate = measured_rate()
    assert rate is not None and 1e4 < rate < 1e8
    assert core_seconds([PROBE], rate=rate)[0] < core_seconds([PROBE], rate=rate / 2)[0]


def test_a_machine_without_yade_says_nothing(tmp_path, monkeypatch):
    shell = Path("/bin/sh").resolve()
    (tmp_path / "sh").symlink_to(shell)
    monkeypatch.setenv("PATH", os.fspath(tmp_path))
    monkeypatch.delenv("YADE", raising=False)
    assert measured_rate() is None
