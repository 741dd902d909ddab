"""What the fuzz tests found, and what was found on the way to them: each bug with a test of its
own.
"""

import json

import pytest
from tests.conftest import LAB
from tests.fake_yade import contract

from calibrator.case.problem import checked_value
from calibrator.case.toml import read_case
from calibrator.case.vocabulary import SCHEMA
from calibrator.cli import main
from calibrator.errors import CalibratorError
from calibrator.runs.database import Database
from calibrator.runs.record import InvalidRecord, Record, read_record
from calibrator.runs.request import Request
from calibrator.runs.setups import steps

REQUEST = Request.of("ledge", seed=1)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("sets = 14", "sets = 9223372036854775807", "give 1e.06 or less"),
        ("sets = 14", "sets = 1000000", "the plan has 2,000,000 runs"),
        ("samples = 2", f"samples = 0x{'f' * 5000}", "beyond 64 bits"),
        ("samples = 2", f"samples = {'9' * 5000}", "is not valid TOML"),
        ("sets = 14", f"sets = {'[' * 5000}", "is not valid TOML"),
        ("sets = 14", f"sets = {'[' * 50 + ']' * 50}", "nested more than ten deep"),
        ("sets = 14", "sets = 1979-05-27", "give a value of type int"),
        ("population = 60", "population = 1000000\nrepeats = 1000", "which would take days"),
        ("population = 60", 'population = 60\nobjectives = ["error", "error"]', "names one twice"),
        ("samples = 2", 'name = "seed"', "has a key name"),
        ("[run]", "[setups.hourglass]\nrolling_friction = 0.1\n[run]", "is what the plan sets"),
        ("[run]", "[setups.hourglass]\nseed = 7\n[run]", "is what the plan sets"),
        ('name = "toy"', 'name = "toy"\nabout = 7', "give a value of type str"),
        ('name = "toy"', 'name = "toy"\ntruth_file = ["a"]', "give a value of type str"),
        ('name = "toy"', f'name = "{"x" * 300}"', "plain word"),
        ('design = "sobol"', 'design = "sobol"\nseed = 100000000', "give 3e.07 or less"),
        ("low = 0.05", 'low = 5e-324\nscale = "log"', "narrow the bounds"),
    ],
)
def test_a_case_that_used_to_end_in_a_traceback_or_a_wrong_plan_is_refused(
    write_case, old, new, why
):
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case((old, new)))


def test_a_truth_that_is_no_number_is_refused(write_case, tmp_path):
    for text in (
        '[parameters]\nrolling_friction = "a"\n',
        "[parameters]\nrolling_friction = []\n",
        "[other]\nx = 1\n",
    ):
        (tmp_path / "truth.toml").write_text(text)
        with pytest.raises(CalibratorError):
            read_case(write_case(('name = "toy"', 'name = "toy"\ntruth_file = "truth.toml"')))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("hourglass,bulk_density", '"hourglass,bulk_density'),
        ("1605.6,5,8", f"1605.6,5,{'9' * 400}"),
        ("1605.6", "1e300"),
        ("1605.6", "5e-324"),
    ],
)
def test_a_lab_file_that_used_to_end_in_a_traceback_is_refused_with_its_line(write_case, old, new):
    with pytest.raises(CalibratorError, match="lab.csv line 3: "):
        read_case(write_case(lab=LAB.replace(old, new)))


def test_an_unknown_objective_is_found_by_check(write_case, tmp_path, capsys):
    path = write_case(("population = 60", 'population = 60\nobjectives = ["eror"]'))
    assert main(["check", str(path), "--results", str(tmp_path)]) == 2
    assert "did you mean error?" in capsys.readouterr().err


def test_a_number_too_large_for_a_float_is_refused_with_a_message_that_can_be_shown():
    for value in (10**400, -(10**400), 10**5000):
        with pytest.raises(CalibratorError, match="give a value from") as caught:
            checked_value("young_modulus", value)
        assert len(str(caught.value)) < 300


def test_a_time_step_next_to_nothing_has_a_cost_too():
    assert steps(Request.of("ledge", time_step=5e-324)) >= 10**15


@pytest.mark.parametrize(
    "change",
    [
        {"status": []},
        {"status": {}},
        {"error": ["a"]},
        {"error": 7},
        {"schema": True},
        {"diagnostics": {"filling_cpu": "long"}},
        {"diagnostics": {"particles": 7.5}},
        {"diagnostics": {"stop_reason": "a\nb"}},
        {"provenance": {"host": "a\nb"}},
        {"provenance": {"wall_time": None}},
        {"responses": {"bulk_density": 1e300}},
        {"responses": {"bulk_density": 10**400}},
        {"parameters": {**REQUEST.parameters, "seed": True}},
    ],
)
def test_a_record_that_would_break_what_follows_is_not_believed(tmp_path, change):
    good = dict(
        schema=SCHEMA, setup="ledge", run_id=REQUEST.run_id, parameters=REQUEST.parameters, status="ok",
        responses={"bulk_density": 1500.0}, error=None, diagnostics={}, provenance={},
    )  # fmt: skip
    (tmp_path / "r.json").write_text(json.dumps(good))
    assert read_record(tmp_path / "r.json", REQUEST).status == "ok"
    (tmp_path / "r.json").write_text(json.dumps({**good, **change}))
    with pytest.raises(InvalidRecord):
        read_record(tmp_path / "r.json", REQUEST)


@pytest.mark.parametrize("error", ["a\rb", "a\nb", 'a "quoted", thing', "\ud800", "\0", "\u2028"])
def test_an_error_of_any_text_survives_the_way_into_a_database_and_back(tmp_path, error):
    Database([Record(REQUEST, "crash", error=error)]).write(tmp_path / "d.csv")
    (back,) = Database.read(tmp_path / "d.csv").records.values()
    assert back.error.isprintable() and back.status == "crash"


def damaged(tmp_path, old, new):
    Database([Record(REQUEST, "ok", {"bulk_density": 1500.0})]).write(tmp_path / "d.csv")
    text = (tmp_path / "d.csv").read_text()
    assert old in text
    (tmp_path / "d.csv").write_text(text.replace(old, new))
    return tmp_path / "d.csv"


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("bulk_density,particles", "bulk_densiti,particles", "did you mean bulk_density"),
        ("bulk_density,particles", "discharge_time,particles", "unknown response of ledge"),
        (",error\n", "\n", "no column error"),
        ("1500.0", "inf", "not finite"),
        ("1500.0", "1500.0,", "line 4: "),
        ("1500.0", '"1500.0', "line 4: "),
    ],
)
def test_a_damaged_database_is_refused_with_its_line(tmp_path, old, new, why):
    with pytest.raises(CalibratorError, match=why):
        Database.read(damaged(tmp_path, old, new))


def test_a_run_that_stands_twice_in_a_database_is_refused(tmp_path):
    path = damaged(tmp_path, "1500.0", "1500.0")
    path.write_text(path.read_text() + path.read_text().splitlines()[-1] + "\n")
    with pytest.raises(CalibratorError, match="stands there twice"):
        Database.read(path)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["chek", "a.toml"],
        ["plan"],
        ["plan", ""],
        ["plan", "a.toml", "--results", ""],
        ["plan", "a\nb", "-x\ny"],
    ],
)
def test_a_mistake_on_the_command_line_is_one_line(capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    error = capsys.readouterr().err
    assert caught.value.code == 2 and error.count("\n") == 1 and error.endswith("--help\n")


@pytest.mark.parametrize("name", ["no\nsuch\rfile", "caf\udce9.toml", "x" * 300, "a" * 5000])
def test_a_case_path_of_any_name_is_shown_on_one_line(capsys, name):
    assert main(["plan", name]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_name_that_is_no_text_is_printed_all_the_same(write_case, tmp_path, capsys):
    path = write_case(("sets = 14", "sets = 2")).rename(tmp_path / "caf\udce9.toml")
    assert main(["plan", str(path), "--results", str(tmp_path / "out")]) == 0
    assert "caf\\udce9.toml" in capsys.readouterr().out


IMPOSSIBLE = [
    10**309, -(10**400), 10**5000, float("nan"), float("inf"), 1e301, "a", None, True, 1j, (1,), [], {}, {1}, object()
]  # fmt: skip


@pytest.mark.parametrize("name", ["young_modulus", "seed", "rolling_spring"])
def test_an_impossible_cell_of_a_table_is_bad_input_to_the_scripts_and_the_record_can_be_written(
    tmp_path, name
):
    """Whatever Python value a cell that somebody wrote by hand becomes in YADE: never an error of
    the scripts' own.
    """
    for value in IMPOSSIBLE:
        with pytest.raises(contract.BadInput, match=f"^{name} = .*: (give|choose) "):
            contract.checked("hourglass", {name: value})
        contract.write_record(tmp_path, "r", {"parameters": contract.echoed({name: value})}, {})
        assert json.loads((tmp_path / "r.json").read_text())["parameters"].keys() == {name}


def test_a_value_that_can_be_used_is_echoed_as_it_is():
    values = {"sliding_friction": 0.1 + 0.2, "seed": 2**31 - 1, "rolling_spring": "epsd"}
    assert contract.echoed(contract.checked("hourglass", values)).items() >= values.items()
