"""The scripts' side of the contract: values of a table's cells, and records."""

import json
import os

import pytest

from tests.fake_yade import contract

IMPOSSIBLE = [
    10**309, -(10**400), 10**5000, float("nan"), float("inf"), 1e301, "a", None, True, 1j, (1, ),
    [], {}, {1}, object()
]  # fmt: skip


@pytest.mark.parametrize("name", ["young_modulus", "seed", "rolling_spring"])
def test_an_impossible_cell_of_a_table_is_bad_input_to_the_scripts_and_the_record_can_be_written(
    tmp_path, name
):
    """Whatever a cell that somebody wrote by hand becomes, it is no error of the scripts' own."""
    for value in IMPOSSIBLE:
        with pytest.raises(contract.BadInput, match=f"^{name} = .*: (give|choose) "):
            contract.checked("hourglass", {name: value})
        contract.write_record(tmp_path, "r", {"parameters": contract.echoed({name: value})}, {})
        assert json.loads((tmp_path / "r.json").read_text())["parameters"].keys() == {name}


def test_a_value_that_can_be_used_is_echoed_as_it_is():
    values = {"sliding_friction": 0.1 + 0.2, "seed": 2**31 - 1, "rolling_spring": "epsd"}
    assert contract.echoed(contract.checked("hourglass", values)).items() >= values.items()


def test_half_a_record_does_not_stay_on_a_full_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        contract.write_record(tmp_path, "r", {}, {})
    assert not list(tmp_path.iterdir())
