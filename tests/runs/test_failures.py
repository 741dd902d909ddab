"""What becomes of runs that leave no record: tried once more, then kept with their reason."""

import pytest

from calibrator.runs import failures, local
from calibrator.runs.local import run
from tests.runs.toy_runs import calls, folder_with, requests


def test_a_crash_is_tried_once_more_and_kept_with_its_reason(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"2": "crash"})
    records = run(folder, requests(), jobs=1)
    assert [r.status for r in records] == ["ok", "ok", "crash", "ok"]
    assert "fake crash" in records[2].error and records[2].responses == {}
    assert calls(folder).count(requests()[2].run_id) == 2
    run(folder, requests(), jobs=1)
    assert calls(folder).count(requests()[2].run_id) == 2  # and not for ever


def test_a_segfault_is_a_crash_however_it_was_reported(tmp_path, fake_yade):
    folder = folder_with(tmp_path, **{"1": "segfault"})
    records = run(folder, requests(2), jobs=1)
    assert [r.status for r in records] == ["ok", "crash"] and records[1].error.startswith(
        "exit code 139"
    )
    for status, code in (
        ("11", 139),
        ("139", 139),
        (str(139 << 8), 139),
        ("9", 137),
        ("0", 0),
        (str(124 << 8), 124),
    ):
        (tmp_path / "log").write_text(f"some output\nstatus  : {status} (some words)\n")
        assert failures.exit_code(tmp_path / "log") == code


@pytest.mark.parametrize("behaviour", ["lie", "half", "nothing"])
def test_a_run_without_a_believable_record_is_lost_not_trusted(tmp_path, fake_yade, behaviour):
    folder = folder_with(tmp_path, **{"1": behaviour})
    records = run(folder, requests(2), jobs=1)
    assert [r.status for r in records] == ["ok", "lost"] and records[1].responses == {}
    assert calls(folder).count(requests(2)[1].run_id) == 2


def test_a_hanging_run_ends_at_its_time_limit(tmp_path, fake_yade, monkeypatch):
    folder = folder_with(tmp_path, **{"0": "hang"})
    environment = local.clean_environment
    monkeypatch.setattr(local, "clean_environment", lambda limit: environment(1.0))
    records = run(folder, requests(2), jobs=1, attempts=1)
    assert [r.status for r in records] == ["timeout", "ok"]
