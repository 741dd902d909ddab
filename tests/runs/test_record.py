"""A record is believed only if it is complete and answers the request exactly."""

import json

import pytest

from calibrator.case.vocabulary import SCHEMA
from calibrator.runs.folder import RunFolder
from calibrator.runs.local import run
from calibrator.runs.record import InvalidRecord, read_record
from calibrator.runs.request import Request
from tests.fake_yade import contract

REQUEST = Request.of("ledge", seed=5)


def good():
    return dict(
        schema=1, setup="ledge", run_id=REQUEST.run_id, parameters=dict(REQUEST.parameters),
        status="ok", responses={"bulk_density": 1500.0}, error=None, diagnostics={"particles": 10},
        provenance={"yade": "x"},
    )  # fmt: skip


def write(tmp_path, record):
    path = tmp_path / "r.json"
    path.write_text(record if isinstance(record, str) else json.dumps(record))
    return path


def test_a_good_record_is_read_as_written(tmp_path):
    record = read_record(write(tmp_path, good()), REQUEST)
    assert (record.status, record.responses, record.run_id) == (
        "ok",
        {"bulk_density": 1500.0},
        REQUEST.run_id,
    )


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"schema": 99}, "schema version"),
        ({"status": "fine"}, "unknown status"),
        ({"extra": 1}, "unknown keys"),
        ({"responses": {"bulk_density": float("nan")}}, "not a number"),
        ({"responses": {"bulk_density": "1500"}}, "not a finite number"),
        ({"responses": {"drained_curvature": 1.0}}, "unknown response"),
        ({"responses": [1]}, "not an object"),
        ({"run_id": "0" * 16}, "not the one asked for"),
        ({"setup": "hourglass"}, "not the one asked for"),
        (
            {"parameters": {**REQUEST.parameters, "sliding_friction": 0.4000000001}},
            "sliding_friction",
        ),
        ({"parameters": {"seed": 5}}, "another value"),
        ({"parameters": {**REQUEST.parameters, "mood": None}}, "another value of mood"),
        ({"diagnostics": {"mood": 1}}, "unknown diagnostics"),
    ],
)
def test_a_record_with_one_thing_wrong_is_refused(tmp_path, change, why):
    with pytest.raises(InvalidRecord, match=why):
        read_record(write(tmp_path, {**good(), **change}), REQUEST)


@pytest.mark.parametrize("cut", [0, 1, 50, -2])
def test_a_truncated_record_is_refused(tmp_path, cut):
    with pytest.raises(InvalidRecord):
        read_record(write(tmp_path, json.dumps(good())[:cut]), REQUEST)


def test_a_missing_key_is_refused(tmp_path):
    for key in good():
        record = good()
        del record[key]
        with pytest.raises(InvalidRecord):
            read_record(write(tmp_path, record), REQUEST)


@pytest.mark.parametrize("number", [1500.0, 0.1 + 0.2, 1e-300, -0.0, 7])
def test_a_sealed_record_is_believed_until_a_number_in_it_changes(tmp_path, number):
    contract.write_record(tmp_path, "r", {**good(), "responses": {"bulk_density": number}}, {})
    record = read_record(tmp_path / "r.json", REQUEST)
    assert record.responses == {"bulk_density": number}
    text = (tmp_path / "r.json").read_text()
    for old, new in (
        (f'"bulk_density": {number}', '"bulk_density": 1501.5'),
        ('"particles": 10', '"particles": 11'),
    ):
        assert old in text
        with pytest.raises(InvalidRecord, match="changed after the run"):
            read_record(write(tmp_path, text.replace(old, new)), REQUEST)


def test_a_sealed_record_nested_without_end_is_refused(tmp_path):
    for depth in range(100, 1000, 10):  # what can just be read can perhaps not be written again
        text = (
            json.dumps({**good(), "seal": "0"})[:-1]
            + f', "traceback": {"[" * depth}{"]" * depth}}}'
        )
        with pytest.raises(InvalidRecord):
            read_record(write(tmp_path, text), REQUEST)


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
        schema=SCHEMA, setup="ledge", run_id=REQUEST.run_id, parameters=REQUEST.parameters,
        status="ok", responses={"bulk_density": 1500.0}, error=None, diagnostics={}, provenance={},
    )  # fmt: skip
    (tmp_path / "r.json").write_text(json.dumps(good))
    assert read_record(tmp_path / "r.json", REQUEST).status == "ok"
    (tmp_path / "r.json").write_text(json.dumps({**good, **change}))
    with pytest.raises(InvalidRecord):
        read_record(tmp_path / "r.json", REQUEST)


def test_a_record_that_is_a_link_is_not_believed(tmp_path, fake_yade):
    folder, request = RunFolder(tmp_path / "runs"), Request.of("ledge")
    run(folder, [request], jobs=1)
    folder.record(request).rename(tmp_path / "elsewhere.json")
    folder.record(request).symlink_to(tmp_path / "elsewhere.json")
    with pytest.raises(InvalidRecord, match="symbolic link"):
        read_record(folder.record(request), request)
    assert [r.status for r in run(folder, [request], jobs=1)] == ["ok"]
