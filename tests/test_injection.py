"""Nothing that a user writes is ever run.

YADE evaluates the cells of a table, and yade-batch starts its jobs by a shell. Each test puts code
that would leave a mark where a user can write, and then does what the dangerous reader does: every
cell of a written table is evaluated by Python's own eval in a process of its own, every line is put
through a shell.
"""

import ast
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.case.vocabulary import PARAMETERS, SCRIPTS, SETUPS
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.plan.forecast import forecast
from calibrator.plan.requests import plan_requests
from calibrator.plan.run import proposed
from calibrator.runs import workspace
from calibrator.runs.database import Database
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import Record
from calibrator.runs.request import Request, cell, write_table
from calibrator.search.outcome import current_calibration
from tests.campaigns.bad_input.rules import only_data, safe_table
from tests.conftest import LAB

NASTY = [
    "a b",
    "it's",
    'double"quote',
    "semi;colon",
    "$(touch mark)",
    "`touch mark`",
    "new\nline",
    "-rf",
    "*",
    "& touch mark &",
]


@pytest.fixture
def spells(tmp_path):
    """Texts that leave a mark if evaluated or given to a shell; none may be there at the end."""
    marks = tmp_path / "marks"
    marks.mkdir()
    python = f"__import__('os').system('touch {marks}/python')"
    yield [
        python,
        f"[0 for _ in [{python}]] or 1",
        f"0.3,exec({python!r})",
        f"'epsd2' if {python} else 'epsd2'",
        f"$(touch {marks}/shell)",
        f"`touch {marks}/shell`",
        f"0.3; touch {marks}/shell;",
        f"0.3\ntouch {marks}/shell\n",
        f"!EXEC touch {marks}/shell",
    ]
    assert not list(marks.iterdir()), "code was run"


def evaluate_and_shell(table):
    """Do with a table what YADE and yade-batch do; returns the values of every line."""
    code = (
        "import sys\nheader, *lines = open(sys.argv[1]).read().splitlines()\nnames ="
        " header.split()\nassert all(len(l.split()) == len(names) for l in lines)\nprint([{n:"
        " eval(c) for n, c in zip(names, l.split()) if n not in ('description', '!SCRIPT')} for l"
        " in lines])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(table)], capture_output=True, text=True, check=True
    )
    commands = []
    for line in table.read_text().splitlines()[1:]:
        description, script = (
            line.split()[0],
            next((c for c in line.split() if c.startswith("scripts/")), ""),
        )
        commands.append(f"YADE_BATCH={table.name}:2 : {script} > /dev/null {description}")
    subprocess.run("\n".join(commands), shell=True, check=True)
    return ast.literal_eval(done.stdout)


def test_the_spells_would_work(tmp_path):
    """The tests below can fail: a table that somebody wrote by hand does run code."""
    mark = tmp_path / "mark"
    (tmp_path / "t.table").write_text(
        f"description seed\nx __import__('os').system('touch\\x20{mark}')\n"
    )
    evaluate_and_shell(tmp_path / "t.table")
    assert mark.exists()


@pytest.mark.parametrize("name", PARAMETERS)
def test_no_parameter_takes_code_for_a_value(name, spells):
    for spell in spells:
        with pytest.raises(CalibratorError):
            cell(name, spell)
        for setup in PARAMETERS[name].setups:
            with pytest.raises(CalibratorError):
                Request.of(setup, **{name: spell})


def test_no_parameter_takes_code_for_its_name(spells):
    for setup in SETUPS:
        for spell in spells:
            with pytest.raises(CalibratorError, match="unknown parameter"):
                Request.of(setup, **{spell: 0.3})


def test_a_value_that_only_looks_like_a_number_is_written_as_one(tmp_path):
    class Sly(float):
        def __repr__(self):
            return "__import__('os')"

    assert cell("sliding_friction", Sly(0.3)) == "0.3"
    assert cell("sliding_friction", np.float64(0.3)) == "0.3"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('name = "toy"', "name = {}"),
        ("low = 0.2", "low = {}"),
        ("high = 0.7", "high = {}"),
        ("samples = 2", "samples = {}"),
        ("samples = 2", "scale = {}"),
        ("samples = 2", "name = {}"),
        ("[plan]", "[fixed]\nrolling_spring = {}\n[plan]"),
        ("[plan]", "[fixed]\nrestitution = {}\n[plan]"),
        ("[plan]", "[fixed]\n{} = 0.9\n[plan]"),
        ("[plan]", "[setups.hourglass]\nfill_mass = {}\n[plan]"),
        ("[plan]", "[setups.{}]\nfill_mass = 0.01\n[plan]"),
        ("[parameters.sliding_friction]", "[parameters.{}]"),
        ("[plan]", "[targets.{}]\nweight = 1.0\n[plan]"),
        ("[plan]", '[targets."hourglass.bulk_density"]\nweight = {}\n[plan]'),
        ('design = "sobol"', "design = {}"),
        ("sets = 14", "sets = {}"),
        ("jobs = 1", "shipped = {}"),
        ("jobs = 1", "jobs = {}"),
        ('measured = "lab.csv"', "measured = {}"),
        ('measured = "lab.csv"', 'measured = "lab.csv"\ntruth_file = {}'),
    ],
)
def test_code_in_a_case_is_refused_before_anything_is_written(
    write_case, tmp_path, spells, capsys, old, new
):
    for spell in spells:
        path = write_case((old, new.format(json.dumps(spell))))
        code = main(["plan", str(path), "--results", str(tmp_path / "out")])
        if "shipped" in new or "measured" in new or "truth" in new:
            assert code == 2  # no such file, or one that leads away
        assert code == 2 and capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_code_in_the_words_about_a_case_stays_words(write_case, tmp_path, spells):
    for spell in spells:
        about = f"about = {json.dumps(spell)}\nmeasured"
        space = workspace.Workspace(
            read_case(write_case(("measured", about), ("sets = 14", "sets = 2"))), tmp_path / "toy"
        )
        forecast(space)
        safe_table(space.path / "plan" / "hourglass.table")
        assert len(evaluate_and_shell(space.path / "plan" / "hourglass.table")) == 4


def test_code_in_any_cell_of_the_lab_file_is_refused(write_case, spells):
    row = "hourglass,mass_flow_rate,0.026,0.0001,8,kg/s,calibrate"
    for position in range(7):
        for spell in spells:
            cells = row.split(",")
            cells[position] = '"' + spell.replace('"', '""') + '"'
            with pytest.raises(CalibratorError):
                read_case(write_case(lab=LAB.replace(row, ",".join(cells))))


@pytest.fixture
def shipped(tmp_path):
    """A database of two runs, and its rows."""
    path = tmp_path / "d.csv"
    Database(
        [Record(Request.of("hourglass", seed=s), "ok", {"bulk_density": 1500.0}) for s in (1, 2)]
    ).write(path)
    return path


def test_code_in_any_cell_of_a_database_is_refused_or_stays_a_word_of_provenance(
    shipped, spells, tmp_path
):
    lines = shipped.read_text().splitlines(keepends=True)
    header = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    columns = lines[header].strip().split(",")
    for position, column in enumerate(columns):
        for spell in spells:
            cells = lines[header + 1].rstrip("\n").split(",")
            cells[position] = '"' + spell.replace('"', '""') + '"'
            shipped.write_text(
                "".join([*lines[: header + 1], ",".join(cells) + "\n", *lines[header + 2 :]])
            )
            if column not in ("yade", "scripts", "error"):
                with pytest.raises(CalibratorError):
                    Database.read(shipped)
                continue
            requests = [r.request for r in Database.read(shipped).records.values()]
            write_table(tmp_path / "t.table", requests)
            safe_table(tmp_path / "t.table")


def test_code_in_a_header_of_a_database_is_refused(shipped, spells):
    text = shipped.read_text()
    for spell in spells:
        shipped.write_text(text.replace("sliding_friction,", '"' + spell.replace('"', '""') + '",'))
        with pytest.raises(CalibratorError):
            Database.read(shipped)


def test_code_in_the_log_of_proposals_is_refused(write_case, tmp_path, spells):
    space = workspace.Workspace(read_case(write_case()), tmp_path / "toy")
    space.path.mkdir()
    good = plan_requests(space.case)[0]
    for spell in spells:
        for made in (
            {"setup": spell, "parameters": good.parameters},
            {"setup": "hourglass", "parameters": {**good.parameters, "rolling_spring": spell}},
            {"setup": "hourglass", "parameters": {**good.parameters, "sliding_friction": spell}},
            {"setup": "hourglass", "parameters": {**good.parameters, spell: 1}},
            {"setup": "hourglass", "parameters": {**good.parameters, "setup": spell}},
        ):
            (space.path / "proposals.jsonl").write_text(json.dumps({"requests": [made]}) + "\n")
            with pytest.raises(CalibratorError, match=r"proposals.jsonl is damaged"):
                proposed(space)


def test_candidates_that_somebody_put_into_the_summary_are_refused(write_case, tmp_path, spells):
    space = workspace.Workspace(read_case(write_case()), tmp_path / "toy")
    for spell in spells:
        parameters = {"rolling_friction": 0.2, "sliding_friction": spell, "young_modulus": 1e6}
        space.path.mkdir(exist_ok=True)
        summary = {
            "calibrate": {"candidates": {"compromise": {"parameters": parameters, "predicted": {}}}}
        }
        (space.path / "summary.json").write_text(json.dumps(summary))
        with pytest.raises(CalibratorError, match=r"summary.json is damaged"):
            current_calibration(space)


@pytest.mark.parametrize("results", NASTY)
def test_a_results_folder_of_any_name_reaches_no_shell(
    write_case, tmp_path, monkeypatch, fake_yade, results
):
    monkeypatch.chdir(tmp_path)
    folder = RunFolder(tmp_path / results / "toy")
    asked = [Request.of("hourglass", seed=1), Request.of("ledge", seed=2)]
    assert [r.status for r in run(folder, asked, jobs=1, attempts=1)] == ["ok", "ok"]
    (table,) = (folder.path / "batches").iterdir()
    safe_table(table)
    values = evaluate_and_shell(table)
    assert {v["seed"] for v in values} == {1, 2}
    assert not list(tmp_path.rglob("mark"))


@pytest.mark.yade
@pytest.mark.parametrize("results", ['it\'s $(touch mark); `touch mark` & "x" new\nline'])
def test_a_real_yade_batch_in_a_folder_of_any_name_runs_nothing_but_yade(tmp_path, results):
    folder = RunFolder(tmp_path / results / "toy")
    box = dict(
        box_length=16e-3,
        box_width=8e-3,
        fill_height=10e-3,
        young_modulus=1e6,
        seed=3,
        longest_time=0.02,
    )
    (record,) = run(folder, [Request.of("ledge", **box)], jobs=1, attempts=1)
    assert record.status == "not_settled"
    assert not list(tmp_path.rglob("mark"))


def test_whatever_reaches_a_shell_is_of_fixed_form(tmp_path):
    """Run ids, set-ups, names of table and log: letters, digits, dots, slashes and hyphens."""
    requests = [Request.of(setup, seed=7) for setup in SETUPS]
    write_table(tmp_path / "t.table", requests)
    for line, request in zip(
        (tmp_path / "t.table").read_text().splitlines()[1:], requests, strict=True
    ):
        description, script, *cells = line.split(" ")
        assert re.fullmatch(r"[0-9a-f]{16}", description) and description == request.run_id
        assert (
            script == f"scripts/{request.setup}.py" and (SCRIPTS / f"{request.setup}.py").is_file()
        )
        assert all(only_data(c) for c in cells)
