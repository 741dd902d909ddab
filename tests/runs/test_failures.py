"""What becomes of runs that leave no record: tried once more, then kept with their reason."""

from calibrator.runs import failures
from calibrator.runs.local import run
from tests.runs.toy_runs import folder_with, requests


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
