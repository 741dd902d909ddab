"""What a case names stays inside its project, and files are whole or not there."""

import io
import os
import pickle
import zipfile

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from calibrator.files import named_file, parse_json, read_arrays, write_text
from calibrator.report import findings
from tests.conftest import LAB

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
    "name", ["", "/etc/passwd", "//etc/passwd", "../../elsewhere/secret.csv",
    "inner/../../../elsewhere/secret.csv", "..//../etc/passwd",
     "away.csv", "../out/secret.csv", "a\0b", "inner/../lab.csv"],
)  # fmt: skip
def test_a_path_that_leaves_the_project_is_refused_with_a_remedy(project, name):
    with pytest.raises(
        CalibratorError, match=r"measured = .* leaves the case's folder: put the file into"
    ) as caught:
        named_file(project, name, "measured")
    assert str(caught.value).isprintable()


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
    with pytest.raises(CalibratorError, match=r"trap|leaves the case's folder"):
        read_case(write_case(('"lab.csv"', '"trap"')))


def test_a_file_of_any_size_is_not_read(write_case, tmp_path):
    with open(tmp_path / "toy.toml", "wb") as stream:
        stream.truncate(2**40)  # sparse
    with pytest.raises(CalibratorError, match="larger than"):
        read_case(tmp_path / "toy.toml")


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
            CalibratorError, match=r"is damaged .*: delete it and its record"
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
        for p in (repo / f).rglob("*.py")
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
    with (
        zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("filled.npy", "w") as member,
    ):
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


# State


@pytest.mark.parametrize(
    "text",
    ["[" * 100_000, "1" * 5000, "1" + "0" * 400, "NaN", '{"a": 1, "a": 2}', "", "\0", "{"],
)
def test_json_with_python_s_liberties_is_a_value_error(text):
    with pytest.raises(ValueError):
        parse_json(text)
