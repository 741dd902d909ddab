"""Every fenced block of the documents is run, read or parsed by what it is meant for."""

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import tomllib

import pytest

from calibrator.case.curve import read_curve
from calibrator.case.lab import read_lab, read_nuisances
from calibrator.case.toml import read_case
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.first_case.answers import answers_of
from calibrator.options import parser
from tests.docs.blocks import PAGES, REPO, blocks, blocks_of

KINDS = {"sh", "console", "toml", "csv", "python", "json", "text"}
ELSEWHERE = {
    ("docs/effects.md", "json"): "tests/test_effect_example.py",
    ("docs/effects.md", "python"): "tests/test_effect_example.py",
    ("docs/own_setup.md", "json"): "tests/docs/test_own_setup.py",
    ("docs/own_setup.md", "python"): "tests/docs/test_own_setup.py",
    ("DESIGN.md", "text"): "tests/test_layers.py",
}
"""Blocks that another test takes from their page."""
FORMULA = ("docs/case_file.md", "text")  # the rule of `bands`, in words that no program reads
GALLERY = "docs/gallery/"  # tests/docs/test_gallery.py has what its commands print, and its cases
NEEDS_YADE = "from yade import"  # tests/handover/test_yade.py runs it
CURVE = "x,value\n" + "".join(f"{0.001 * i:g},{0.005 - 0.0005 * i:g}\n" for i in range(1, 7))
OTHERS = {"sudo", "pipx", "podman", "pip", "git", ".", "yade", "eval"}
"""Programs of the machine: only whether the shell understands the line is checked."""


def elsewhere(block):
    """Whether another test takes the block."""
    return (block.page, block.kind) in ELSEWHERE


def chosen(*kinds):
    """The blocks of some kinds that are checked here."""
    found = [b for b in blocks(*kinds) if not elsewhere(b)]
    return pytest.mark.parametrize("block", found, ids=str)


def test_every_block_says_what_it_is_and_is_of_a_kind_that_is_checked():
    for page in PAGES:
        text = page.read_text()
        assert text.count("```") == 2 * len(blocks_of(page)), f"{page}: a block does not end"
        for block in blocks_of(page):
            assert block.kind in KINDS or block.kind.startswith("{"), f"{block}: no such kind"
            if block.kind in ("text", "json"):
                assert elsewhere(block) or (block.page, block.kind) == FORMULA, f"{block}"
        outside = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
        assert (
            not re.search(r"(?:\A|\n\n)    \S", outside)
            or "\n- " in outside
            or ("\n1. " in outside)
        ), f"{page}: an indented block, whose kind nobody knows"


def test_what_is_said_to_be_tested_elsewhere_is():
    for (page, _), test in ELSEWHERE.items():
        assert page.rpartition("/")[2] in (REPO / test).read_text()
    assert blocks("sh") and blocks("console") and blocks("toml") and blocks("python")


# Command lines


def commands_of(block):
    """The command lines of a block, in words."""
    lines = block.text.splitlines()
    if block.kind == "console":
        lines = [line[2:] for line in lines if line.startswith("$ ")]
    words = [shlex.split(line, comments=True) for line in lines]
    return [w for w in words if w]


def require_command(words):
    """Fail where the program, or the calibrator's own parser, would not take the words."""
    program, *rest = words
    while "=" in program and rest:  # HIDE=bond_number make ..., YADE=... calibrator ...
        program, *rest = rest
    if program == "calibrator":
        if rest[:1] != ["--print-completion"]:
            assert isinstance(parser().parse_args(rest), argparse.Namespace)
    elif program == "make":
        targets = re.findall(r"^([\w-]+):", (REPO / "Makefile").read_text(), re.M)
        assert {w for w in rest if "=" not in w} <= set(targets), rest
    elif program.endswith("python"):
        assert rest[0] == "-m", rest  # tests/test_documents.py looks for the module
    else:
        assert program in OTHERS, f"{program}: say in OTHERS what is checked of it"


@chosen("sh", "console")
def test_every_command_line_is_one(block, capsys):
    for words in commands_of(block):
        try:
            require_command(words)
        except SystemExit:
            pytest.fail(f"{shlex.join(words)}: {capsys.readouterr().err}")
    text = "\n".join(shlex.join(w) for w in commands_of(block))
    subprocess.run(["bash", "-n", "-c", text], check=True)


CHEAP = {"plan", "run", "collect", "calibrate", "diagnose"}


@chosen("console")
def test_what_a_page_shows_is_what_the_command_prints(block, tmp_path_factory, capsys, monkeypatch):
    """On shipped runs, in order and in one folder for each page's case; no run is made."""
    monkeypatch.chdir(REPO)
    (words,) = commands_of(block)
    shown = [line for line in block.text.splitlines() if not line.startswith("$ ")]
    if not shown:
        return  # how it is called is all that the page says
    if block.page.startswith(GALLERY):
        return
    verb, case = words[1:3]
    assert verb in CHEAP, f"{verb} makes runs, or takes long: show no output that nobody compares"
    results = tmp_path_factory.mktemp("console")
    before = {"calibrate": ["run"], "collect": ["run"]}
    for each in [*before.get(verb, []), verb]:
        capsys.readouterr()
        assert main([each, case, "--results", str(results)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert " ".join(" ".join(shown).split()) in said


# Cases, answers, and lab files

BASE = {
    "": 'name = "documented"\nmeasured = "lab.csv"\n',
    "parameters": "[parameters.rolling_friction]\nlow = 0.1\nhigh = 0.4\n"
    "[parameters.sliding_friction]\nlow = 0.2\nhigh = 0.6\n"
    "[parameters.young_modulus]\nlow = 1e6\nhigh = 9e6\n"
    "[parameters.particle_density]\nlow = 2000\nhigh = 3000\n",
}
LAB = """setup,condition,response,value,scatter,replicates,unit,role
hourglass,,bulk_density,1588,2.7,8,kg/m3,calibrate
hourglass,,mass_flow_rate,0.0282,0.0017,8,kg/s,calibrate
conical_pile,,pile_equivalent_angle_deg,19.7,0.5,6,deg,calibrate
rotating_drum,,drum_angle_deg,32,0.5,6,deg,calibrate
ledge,,ledge_equivalent_angle_deg,37,0.6,6,deg,held_out
"""


def read_fragment(text, folder):
    """Read a case that holds this part, and for the rest what is needed."""
    part = tomllib.loads(text)
    head = re.split(r"^\[", text, maxsplit=1, flags=re.M)[0]
    own = "".join(words for table, words in BASE.items() if table and table not in part)
    (folder / "case.toml").write_text(BASE[""] + head + own + text.removeprefix(head))
    rows = "".join(
        f"{spec['setup']},{name},bulk_density,1600,3,5,kg/m3,diagnose\n"
        if spec["setup"] != "rotating_drum"
        else f"{spec['setup']},{name},drum_angle_deg,40,0.5,5,deg,held_out\n"
        for name, spec in part.get("conditions", {}).items()
    )
    if "conical_pile.profile_height" in part.get("targets", {}):
        rows += "conical_pile,,profile_height,heap.csv,,5,m,calibrate\n"
        (folder / "heap.csv").write_text(CURVE)
    (folder / "lab.csv").write_text(LAB + rows)
    return read_case(folder / "case.toml")


@chosen("toml")
def test_every_case_or_part_of_one_is_read(block, tmp_path):
    table = tomllib.loads(block.text)
    if "measured" in table:  # a whole case, which is one of a file
        files = [p for f in ("cases", "gallery") for p in (REPO / f).glob("*.toml")]
        (path,) = [path for path in files if path.read_text() == block.text]
        assert read_case(path).name == table["name"]
    elif "grain_diameter" in table:
        assert answers_of(table).name == table["name"]
    else:
        assert read_fragment(block.text, tmp_path).problem.targets


def test_a_part_with_a_misspelt_key_is_refused(tmp_path):
    """Else the test above would pass whatever the blocks hold."""
    with pytest.raises(CalibratorError, match="replicats"):
        read_fragment("[verify]\nreplicats = 3\n", tmp_path)


@chosen("csv")
def test_every_table_is_read(block, tmp_path, capsys):
    path = tmp_path / "table.csv"
    path.write_text(block.text)
    head = next(line for line in block.text.splitlines() if not line.startswith("#"))
    kind = head.split(",")[0]
    if kind == "setup":
        for name in re.findall(r"\w+\.csv", block.text):  # curves that rows name
            (tmp_path / name).write_text(CURVE)
        assert read_lab(path)
    elif kind == "x":
        assert len(read_curve(path).x) >= 5
    elif kind == "nuisance":
        assert read_nuisances(path, read_lab(REPO / "cases" / "missing_effect_lab.csv"))
    else:
        assert main(["measure", "readings", str(path), "--setup", "hourglass"]) == 0


# Python


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """A folder with my_sand.toml, the demo's case, calibrated on the shipped runs."""
    folder = tmp_path_factory.mktemp("project") / "own"
    folder.mkdir()
    shutil.copytree(REPO / "grid", folder.parent / "grid")
    for name in ("coarse_sand_lab.csv", "coarse_sand_truth.toml"):
        shutil.copy(REPO / "cases" / name, folder)
    text = (REPO / "cases" / "coarse_sand.toml").read_text()
    for old, new in (('coarse_sand"\n', 'my_sand"\n'), ("500", "100"), ("60\n", "20\n")):
        text = text.replace(old, new)
    (folder / "my_sand.toml").write_text(text)
    for verb in ("run", "calibrate"):
        arguments = [verb, str(folder / "my_sand.toml"), "--results", str(folder / "results")]
        assert main(arguments) == 0
    return folder


@chosen("python")
def test_every_program_runs(block, calibrated):
    if NEEDS_YADE in block.text:
        assert block.page == "docs/export.md"
        return
    ended = subprocess.run(
        [sys.executable, "-c", block.text],
        cwd=calibrated,
        env={"PYTHONPATH": str(REPO), "PATH": "/usr/bin:/bin", "HOME": str(calibrated)},
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 0, ended.stderr
