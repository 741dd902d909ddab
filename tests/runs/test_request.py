"""Requests and tables."""

import ast

import pytest

from calibrator.case.vocabulary import EFFECTS, PARAMETERS, parameters_of
from calibrator.errors import CalibratorError
from calibrator.runs.request import Request, cell, write_table


def test_a_request_is_complete_and_its_id_depends_on_every_parameter():
    request = Request.of("ledge", seed=3)
    assert set(request.parameters) == {
        n for n, q in parameters_of("ledge").items() if not q.unmentioned
    }
    ids = {request.run_id}
    for name, value in request.parameters.items():
        other = (
            "epsd" if name == "rolling_spring" else 7 if name == "seed" else value * 1.01 or 1e-5
        )
        ids.add(Request.of("ledge", **{"seed": 3, name: other}).run_id)
    assert len(ids) == 1 + len(request.parameters)


def test_an_effect_that_is_off_leaves_a_request_as_it_was_before_there_were_effects(tmp_path):
    """The run ids of shipped databases depend on it: this one is from before."""
    off = Request.of("hourglass", shaking=0.0, **{n: q.default for n, q in EFFECTS.items()})
    assert off == Request.of("hourglass") and off.run_id == "fa3594163ceac26f"
    assert off.value("bond_number") == 0.0
    on = Request.of("hourglass", bond_number=0.5)
    assert on.run_id != off.run_id and on.value("bond_number") == 0.5
    write_table(tmp_path / "t.table", [off, on])
    header, *lines = (tmp_path / "t.table").read_text().splitlines()
    assert set(header.split()) & set(EFFECTS) == {"bond_number"}
    assert [line.split()[header.split().index("bond_number")] for line in lines] == ["0.0", "0.5"]


def test_an_integer_and_the_equal_float_are_the_same_run():
    assert (
        Request.of("ledge", young_modulus=5000000).run_id
        == Request.of("ledge", young_modulus=5e6).run_id
    )


def test_a_table_gives_every_value_back_exactly(tmp_path):
    requests = [
        Request.of("hourglass", sliding_friction=0.1 + 0.2, young_modulus=1e7 / 3, seed=s)
        for s in (1, 2)
    ]
    write_table(tmp_path / "t.table", requests)
    text = (tmp_path / "t.table").read_text()
    header, *lines = text.splitlines()
    assert text.endswith("\n") and header.split()[0] == "description"
    for line, request in zip(lines, requests, strict=True):
        cells = dict(zip(header.split(), line.split(), strict=True))
        assert cells.pop("description") == request.run_id
        assert {n: ast.literal_eval(c) for n, c in cells.items()} == request.parameters


def test_a_table_of_two_set_ups_names_the_script_of_each_line_and_completes_foreign_columns(
    tmp_path,
):
    requests = [Request.of("hourglass", neck_diameter=0.013), Request.of("ledge", box_length=0.04)]
    write_table(tmp_path / "t.table", requests)
    header, *lines = (tmp_path / "t.table").read_text().splitlines()
    for line, request in zip(lines, requests, strict=True):
        cells = dict(zip(header.split(), line.split(), strict=True))
        assert cells["!SCRIPT"] == f"scripts/{request.setup}.py"
        assert {n: ast.literal_eval(cells[n]) for n in request.parameters} == request.parameters
        assert ast.literal_eval(cells.get("lift_speed", "1")) == 1


@pytest.mark.parametrize(
    "evil",
    ["__import__('os').system('true')", "1e5)", "inf", "nan", "'epsd'; 1", None, True, [1], 1j],
)
def test_no_cell_carries_anything_but_a_number_or_a_known_word(evil):
    for name in PARAMETERS:
        with pytest.raises(CalibratorError):
            cell(name, evil)


def test_a_misspelt_parameter_is_refused_with_the_nearest_name():
    with pytest.raises(CalibratorError, match="did you mean rolling_friction"):
        Request.of("hourglass", roling_friction=0.1)


def test_a_parameter_of_another_set_up_is_refused():
    with pytest.raises(CalibratorError, match="unknown parameter of ledge"):
        Request.of("ledge", neck_diameter=0.01)
