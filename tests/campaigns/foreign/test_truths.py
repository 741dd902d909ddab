"""The sealed truths, as far as they need no run."""

from collections import Counter

import numpy as np
import pytest

from calibrator.case.toml import read_case
from calibrator.diagnosis import experiments as ex
from tests.campaigns.foreign import laboratories, truths


@pytest.fixture(scope="module")
def case():
    return read_case(truths.CASE)


@pytest.fixture(scope="module")
def drawn(case):
    return truths.drawn(case, 1)


def test_there_are_as_many_of_each_kind_and_the_first_have_nothing_and_one_of_each(drawn):
    kinds = Counter(one.kind for one in drawn)
    every = (*truths.IN_LIBRARY, *truths.OUTSIDE)
    assert kinds == {"nothing": truths.NOTHING, **dict.fromkeys(every, truths.EACH)}
    first = Counter(one.kind for one in drawn[: truths.NOTHING + len(every)])
    assert first == {"nothing": truths.NOTHING, **dict.fromkeys(every, 1)}


def test_nothing_hidden_spans_the_whole_box(case, drawn):
    plain = [list(one.parameters.values()) for one in drawn if one.kind == "nothing"]
    low, high = (
        np.array([getattr(p, e) for p in case.problem.parameters]) for e in ("low", "high")
    )
    cells = np.sort(np.floor((np.array(plain) - low) / (high - low) * truths.NOTHING), axis=0)
    assert (cells == np.arange(truths.NOTHING)[:, None]).all()


def test_sizes_go_from_weak_to_strong(drawn):
    for kind in truths.IN_LIBRARY:
        sizes = sorted(abs(one.size) for one in drawn if one.kind == kind)
        ends = truths.SIZES
        assert all(a <= s <= b for a, s, b in zip(ends, sizes, ends[1:], strict=False))


def test_the_runs_hide_what_the_truth_says_and_share_no_seed(case, drawn):
    found, seeds = ex.experiments(case, case.observables), []
    for one in drawn:
        for e, own in zip(found, one.requests(case, found), strict=True):
            seeds += [r.parameters["seed"] for r in own]
            for name, value in one.hidden.items():
                if name in e.values:
                    assert own[0].value(name) == 0.0  # dried
                elif name != "neck_error" or e.setup == "hourglass":
                    assert own[0].value(name) == value
    assert len(set(seeds)) == len(seeds)


def test_a_series_follows_the_last_one_with_numbers_and_seeds_of_its_own(
    case, tmp_path, monkeypatch
):
    monkeypatch.setattr(truths, "SERIES", tmp_path)
    assert [truths.seal(case), truths.seal(case)] == [1, 2]
    every = truths.opened()
    assert list(every) == list(range(1, 2 * truths.IN_A_SERIES + 1))
    assert {truths.series_of(n) for n in list(every)[: truths.IN_A_SERIES]} == {1}
    assert {truths.series_of(n) for n in list(every)[truths.IN_A_SERIES :]} == {2}
    found = ex.experiments(case, case.observables)
    seeds = [
        {r.parameters["seed"] for own in one.requests(case, found) for r in own}
        for one, _ in every.values()
    ]
    assert len(set().union(*seeds)) == sum(map(len, seeds))
    lines = [(p / "commitments.txt").read_text().splitlines() for p in truths.sealed()]
    assert [len(own) for own in lines] == [truths.IN_A_SERIES] * 2 and not {*lines[0]} & {*lines[1]}


def test_the_shipped_seals_hold():
    assert list(truths.opened()) == list(range(1, len(truths.sealed()) * truths.IN_A_SERIES + 1))


def test_an_edited_truth_breaks_the_seal(case, tmp_path, monkeypatch):
    monkeypatch.setattr(truths, "SERIES", tmp_path)
    truths.seal(case)
    assert len(truths.opened()) == truths.IN_A_SERIES
    (folder,) = truths.sealed()
    lines = truths.unpacked(folder)
    index = next(i for i, line in enumerate(lines) if '"kind": "nothing"' in line)
    lines[index] = lines[index].replace('"kind": "nothing"', '"kind": "tilt_deg"')
    truths.pack(lines, folder)
    with pytest.raises(SystemExit, match="the seal is broken"):
        truths.opened()


def row(number, experiment, seed, good):
    found = dict.fromkeys(experiment.responses, "1.0" if good else "")
    status = "ok" if good else "clogged"
    return {
        "laboratory": str(number), "experiment": experiment.name, "seed": str(seed),
        "status": status, **found,
    }  # fmt: skip


def test_spare_runs_are_made_where_fewer_than_five_end_well(case):
    (e, *_) = ex.experiments(case, case.observables)
    rows = [row(1, e, i, good=i < 2) for i in range(truths.REPLICATES)]
    assert laboratories.wanted([], 1, e) == truths.REPLICATES
    assert laboratories.wanted(rows, 1, e) == truths.REPLICATES + 3
    bad = [row(1, e, i, good=False) for i in range(truths.MOST)]
    assert laboratories.wanted(bad, 1, e) == truths.MOST
