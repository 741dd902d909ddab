"""What a case names stays inside its project, what a run leaves stays inside its results, and files
are whole or not there.
"""

import fcntl
import io
import os
import pickle
import subprocess
import zipfile

import numpy as np
import pytest
from tests.conftest import LAB
from tests.fake_yade import contract

from calibrator.case.toml import read_case
from calibrator.case.vocabulary import SCRIPTS
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.files import named_file, parse_json, read_arrays, write_text
from calibrator.plan import forecast
from calibrator.plan.run import note_proposal, proposed
from calibrator.report import findings
from calibrator.runs import workspace
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request, write_table
from calibrator.verification.verify import verification_requests

# What a case names


@pytest.fixture
def project(tmp_path):
    """project/cases/x.toml with neighbours, and a secret outside."""
    for folder in ("project/cases/inner", "project/grid", "elsewhere"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "elsewhere" / "secret.csv").write_text(LAB)
    (tmp_path / "project" / "cases" / "away.csv").symlink_to(tmp_path / "elsewhere" / "secret.csv")
    (tmp_path / "project" / "out").symlink_to(tmp_path / "elsewhere")
    return tmp_path / "project" / "cases" / "x.toml"


@pytest.mark.parametrize(
    "name", ["lab.csv", "inner/lab.csv", "./lab.csv", "../grid/runs.csv", "../lab.csv"]
)
def test_a_case_may_name_files_of_its_folder_and_of_the_one_above(project, name):
    assert named_file(project, name, "measured") == project.parent / name


@pytest.mark.parametrize(
    "name",
    ["", "/etc/passwd", "//etc/passwd", "../../elsewhere/secret.csv", "inner/../../../elsewhere/secret.csv", "..//../etc/passwd",
     "away.csv", "../out/secret.csv", "a\0b", "inner/../lab.csv"],
)  # fmt: skip
def test_a_path_that_leaves_the_project_is_refused_with_a_remedy(project, name):
    with pytest.raises(
        CalibratorError, match="measured = .* leaves the case's folder: put the file into"
    ) as caught:
        named_file(project, name, "measured")
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("measured", ('"lab.csv"', '"/etc/passwd"')),
        (
            "truth_file",
            ("[parameters.rolling", 'truth_file = "../../truth.toml"\n[parameters.rolling'),
        ),
        ("run.shipped", ("jobs = 1", 'shipped = "../../runs.csv"')),
        ("verify.shipped", ("[verify]", '[verify]\nshipped = "/tmp/runs.csv"')),
        ("validate.shipped", ("[verify]", '[validate]\nshipped = "a/../../runs.csv"\n[verify]')),
    ],
)
def test_every_key_that_names_a_file_is_held_to_that(write_case, key, change):
    with pytest.raises(CalibratorError, match=f"{key} = .* leaves the case's folder"):
        read_case(write_case(change))


def test_the_words_of_a_file_that_is_no_lab_file_are_not_repeated(write_case, tmp_path):
    (tmp_path / "key.txt").write_text("the secret key\n")
    with pytest.raises(CalibratorError) as caught:
        read_case(write_case(('"lab.csv"', '"key.txt"')))
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("trap", ["pipe", "folder", "device", "loop"])
def test_only_regular_files_are_read_and_none_is_waited_for(write_case, tmp_path, trap):
    path = tmp_path / "trap"
    {
        "pipe": lambda: os.mkfifo(path),
        "folder": path.mkdir,
        "device": lambda: path.symlink_to("/dev/zero"),
        "loop": lambda: path.symlink_to(path),
    }[trap]()
    with pytest.raises(CalibratorError, match="trap"):
        read_case(path)
    with pytest.raises(CalibratorError, match="trap|leaves the case's folder"):
        read_case(write_case(('"lab.csv"', '"trap"')))


def test_a_file_of_any_size_is_not_read(write_case, tmp_path):
    with open(tmp_path / "toy.toml", "wb") as stream:
        stream.truncate(2**40)  # sparse
    with pytest.raises(CalibratorError, match="larger than"):
        read_case(tmp_path / "toy.toml")


def test_the_mark_of_an_editor_before_the_text_is_no_error(write_case, tmp_path):
    path = write_case()
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    (tmp_path / "lab.csv").write_bytes(b"\xef\xbb\xbf" + LAB.replace("\n", "\r\n").encode())
    assert len(read_case(path).problem.targets) == 3


# What is written


def test_a_file_is_replaced_whole_and_a_link_in_its_place_is_not_followed(tmp_path):
    (tmp_path / "outside").write_text("mine")
    (tmp_path / "inside").symlink_to(tmp_path / "outside")
    (tmp_path / f"inside.{os.getpid()}.tmp").symlink_to(tmp_path / "outside")
    write_text(tmp_path / "inside", "new")
    assert (tmp_path / "outside").read_text() == "mine"
    assert (tmp_path / "inside").read_text() == "new" and not (tmp_path / "inside").is_symlink()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["inside", "outside"]


def test_a_write_that_fails_leaves_the_old_file_and_no_half_of_a_new_one(tmp_path, monkeypatch):
    write_text(tmp_path / "a", "old")
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        write_text(tmp_path / "a", "new")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a", "old")]


@pytest.mark.parametrize("name", ["", "plan"])
def test_a_link_in_place_of_a_results_folder_is_refused(write_case, tmp_path, name, capsys):
    outside = tmp_path / "outside"
    outside.mkdir()
    link = tmp_path / "out" / "toy" / name
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(outside)
    assert main(["plan", str(write_case()), "--results", str(tmp_path / "out")]) == 2
    assert "symbolic link" in capsys.readouterr().err and not list(outside.iterdir())


@pytest.mark.parametrize("name", ["records", "logs", "batches", "locks"])
def test_no_run_writes_through_a_link(tmp_path, fake_yade, name):
    (tmp_path / "runs").mkdir()
    (tmp_path / "outside").mkdir()
    (tmp_path / "runs" / name).symlink_to(tmp_path / "outside")
    with pytest.raises(CalibratorError, match="symbolic link"):
        run(RunFolder(tmp_path / "runs"), [Request.of("ledge")], jobs=1)
    assert not list((tmp_path / "outside").iterdir())


def test_links_in_place_of_files_that_a_run_writes_are_replaced(tmp_path, fake_yade):
    folder, request = RunFolder(tmp_path / "runs"), Request.of("ledge")
    folder.prepare()
    for name in ("records/{}.json", "logs/{}.log", "locks/{}", "logs/yade-batch.log"):
        victim = tmp_path / name.format("victim").replace("/", "_")
        victim.write_text("mine")
        (folder.path / name.format(request.run_id)).symlink_to(victim)
    assert [r.status for r in run(folder, [request], jobs=1)] == ["ok"]
    assert [p.read_text() for p in tmp_path.glob("*_victim*")] == ["mine"] * 3
    assert (tmp_path / "logs_yade-batch.log").read_text() == "mine"


@pytest.mark.parametrize("link", ["locks", "locks/{}"])
def test_the_wrapper_opens_no_lock_that_is_a_link(tmp_path, fake_yade, link):
    """The driver removes such a link before a batch; this one was put there after that."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "victim").write_text("mine")
    request, place = Request.of("ledge"), tmp_path / link.format(Request.of("ledge").run_id)
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(tmp_path / "outside" / ("victim" if "/" in link else ""))
    write_table(tmp_path / "runs.table", [request])
    done = subprocess.run(
        ["sh", SCRIPTS / "run_yade.sh", "-x", "scripts/ledge.py"],
        cwd=tmp_path,
        env={**os.environ, "YADE_BATCH": "runs.table:2", "CALIBRATOR_TIME_LIMIT": "60"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and "is a symbolic link: remove it" in done.stderr
    assert not (tmp_path / "records").exists() and [
        p.name for p in (tmp_path / "outside").iterdir()
    ] == ["victim"]
    assert (tmp_path / "outside" / "victim").read_text() == "mine"


def test_a_lock_that_is_never_released_ends_in_a_timeout(tmp_path, fake_yade):
    """A YADE that hangs may have lost its driver and its clock to kill -9; the run that waits for
    it must not hang too.
    """
    write_table(tmp_path / "runs.table", [Request.of("ledge")])
    (tmp_path / "locks").mkdir()
    limited = {**os.environ, "YADE_BATCH": "runs.table:2", "CALIBRATOR_TIME_LIMIT": "0.2"}
    with open(tmp_path / "locks" / Request.of("ledge").run_id, "w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        done = subprocess.run(
            ["sh", SCRIPTS / "run_yade.sh", "-x", "scripts/ledge.py"],
            cwd=tmp_path,
            env=limited,
            timeout=60,
        )
    assert done.returncode == 124 and not (tmp_path / "calls.txt").exists()


def test_half_a_record_does_not_stay_on_a_full_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        contract.write_record(tmp_path, "r", {}, {})
    assert not list(tmp_path.iterdir())


def test_a_record_that_is_a_link_is_not_believed(tmp_path, fake_yade):
    folder, request = RunFolder(tmp_path / "runs"), Request.of("ledge")
    run(folder, [request], jobs=1)
    folder.record(request).rename(tmp_path / "elsewhere.json")
    folder.record(request).symlink_to(tmp_path / "elsewhere.json")
    with pytest.raises(InvalidRecord, match="symbolic link"):
        read_record(folder.record(request), request)
    assert [r.status for r in run(folder, [request], jobs=1)] == ["ok"]


# Arrays


class Spell:
    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


def bytes_of(save, *arrays, **named):
    stream = io.BytesIO()
    save(stream, *arrays, **named)
    return stream.getvalue()


def test_a_pickle_in_the_arrays_of_a_run_is_refused_with_one_line_and_never_loaded(
    tmp_path, monkeypatch
):
    mark, path = tmp_path / "mark", tmp_path / "r.npz"
    spell = np.array([Spell(mark)], dtype=object)
    for data in (
        bytes_of(np.savez, filled=spell),
        bytes_of(np.save, spell),
        pickle.dumps(Spell(mark)),
    ):
        path.write_bytes(data)
        about = type(
            "F",
            (),
            {
                "space": type(
                    "S", (), {"runs": type("R", (), {"curves": lambda self, run_id: path})()}
                )()
            },
        )()
        with pytest.raises(
            CalibratorError, match="is damaged .*: delete it and its record"
        ) as caught:
            findings.arrays_of(about, type("Run", (), {"run_id": "r"})())
        assert str(caught.value).isprintable() and not mark.exists()


def test_every_np_load_of_the_project_refuses_pickles():
    import ast
    from pathlib import Path

    repo = Path(__file__).resolve().parent.parent
    for path in [
        p
        for f in ("calibrator", "yade_scripts", "benchmarks", "cases", "tests")
        for p in (repo / f).glob("*.py")
    ]:
        for node in ast.walk(ast.parse(path.read_text())):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and ast.unparse(node.func) == "np.load"
            ):
                assert all(
                    k.arg != "allow_pickle" or k.value.value is False for k in node.keywords
                ), path
            if isinstance(node, ast.Call) and ast.unparse(node.func) in (
                "pickle.load",
                "pickle.loads",
                "joblib.load",
            ):
                raise AssertionError(f"{path} unpickles")


@pytest.mark.parametrize("what", ["half", "garbage", "text", "bomb", "words"])
def test_damaged_arrays_are_a_value_error(tmp_path, what):
    path, good = tmp_path / "r.npz", bytes_of(np.savez_compressed, filled=np.zeros((9, 3)))
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("filled.npy", "w") as member:
            for _ in range(300):
                member.write(bytes(2**20))
    data = {
        "half": good[: len(good) // 2],
        "garbage": b"PK\x03\x04" + bytes(99),
        "text": b"hello",
        "bomb": bomb.getvalue(),
    }
    path.write_bytes(data[what] if what in data else bytes_of(np.savez, filled=np.array(["a"])))
    with pytest.raises(ValueError):
        read_arrays(path)


@pytest.mark.parametrize(
    "arrays",
    [
        {"filled": np.zeros((0, 3))},
        {"filled": np.zeros(3)},
        {"filled": np.full((2, 3), np.nan)},
        {"time": np.zeros(3), "passed_mass": np.zeros(2)},
        {"profile_x": np.zeros(3)},
    ],
)
def test_arrays_of_a_wrong_shape_never_reach_a_figure(arrays):
    with pytest.raises(ValueError):
        findings._checked_curves(arrays)


# State


@pytest.mark.parametrize(
    "text",
    ["[" * 100_000, "1" * 5000, "1" + "0" * 400, "NaN", '{"a": 1, "a": 2}', "", "\0", "{"],
)
def test_json_with_python_s_liberties_is_a_value_error(text):
    with pytest.raises(ValueError):
        parse_json(text)


@pytest.mark.parametrize(
    "state",
    [
        "{}",
        "[]",
        "null",
        '{"calibrate": {}}',
        '{"calibrate": {"candidates": {"compromise": 1}}}',
        "[" * 9999,
        '{"seal": "0"}',
        "",
    ],
)
@pytest.mark.parametrize("verb", ["verify", "validate", "report", "plan"])
def test_a_damaged_summary_is_one_line_for_every_verb(write_case, tmp_path, capsys, state, verb):
    (tmp_path / "out" / "toy").mkdir(parents=True)
    (tmp_path / "out" / "toy" / "summary.json").write_text(state)
    assert (
        main([verb, str(write_case(("sets = 14", "sets = 2"))), "--results", str(tmp_path / "out")])
        == 2
    )
    error = capsys.readouterr().err
    assert "summary.json is damaged" in error and error.count("\n") == 1


def test_a_summary_edited_by_hand_is_not_believed(write_case, tmp_path):
    space = workspace.Workspace(read_case(write_case(("sets = 14", "sets = 2"))), tmp_path / "toy")
    forecast.plan(space)
    assert space.outcome("plan")["runs"] == 4
    path = space.path / "summary.json"
    path.write_text(path.read_text().replace('"runs": 4', '"runs": 5', 1))
    with pytest.raises(CalibratorError, match="edited"):
        space.summary()


def test_a_case_that_changed_since_calibrate_is_told_so(write_case, tmp_path):
    space = workspace.Workspace(read_case(write_case()), tmp_path / "toy")
    parameters = {"rolling_friction": 0.2, "sliding_friction": 0.5, "young_modulus": 1e6}
    predicted = {t.key: {"mean": 1.0, "error": 0.0} for t in space.case.problem.targets}
    space.note(
        "calibrate",
        {"candidates": {"compromise": {"parameters": parameters, "predicted": predicted}}},
    )
    assert len(verification_requests(space)["compromise"]) == 4
    for change in (
        ("[parameters.sliding_friction]\nlow = 0.2\nhigh = 0.7\nsamples = 4\n", ""),
        ("low = 0.2", "low = 0.6"),
    ):
        other = workspace.Workspace(read_case(write_case(change)), tmp_path / "toy")
        with pytest.raises(
            CalibratorError, match="has changed since calibrate: run `calibrator calibrate"
        ):
            verification_requests(other)


@pytest.mark.parametrize(
    "state",
    [
        "[]",
        '{"a": 1}',
        '{"a": {"kind": "ok", "message": "", "attempts": 1}}',
        '{"a": {"kind": 1}}',
        "[" * 9999,
    ],
)
def test_a_damaged_list_of_failures_is_one_line(tmp_path, state):
    (tmp_path / "failures.json").write_text(state)
    with pytest.raises(CalibratorError, match="failures.json is damaged .*: delete it"):
        RunFolder(tmp_path).failures()


def test_a_log_of_proposals_is_whole_after_every_write(write_case, tmp_path, monkeypatch):
    from calibrator.plan.adaptive import Proposal

    space = workspace.Workspace(read_case(write_case()), tmp_path / "toy")
    proposal = Proposal("explore", np.zeros((1, 3)), np.zeros(3), 0.1, "a run")
    for seed in (1, 2):
        note_proposal(space, proposal, [Request.of("ledge", seed=seed)])
    assert [r.parameters["seed"] for r in proposed(space)] == [1, 2]
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError):
        note_proposal(space, proposal, [Request.of("ledge", seed=3)])
    assert [r.parameters["seed"] for r in proposed(space)] == [1, 2]
