"""Which snapshots are shown, and that damaged ones are not."""

import numpy as np
import pytest

from calibrator.errors import CalibratorError
from calibrator.view.snapshots import Film, read_snapshot


def film(stages, times, speeds):
    return Film(tuple(map(str, times)), np.array(stages), np.array(times), np.array(speeds, float))


FILM = film(
    [0] * 10 + [1] * 90,
    np.arange(1, 101) / 100,
    [1] * 5 + [0.01] * 5 + [0.1] * 40 + [0.0001] * 50,
)


def test_the_ends_of_the_filling_and_of_the_run_are_always_shown():
    for count in (4, 11, 40, 200):
        chosen = FILM.chosen(count)
        assert {9, 99} <= set(chosen) and chosen == sorted(set(chosen)) and len(chosen) <= count


def test_frames_are_even_over_the_time_in_which_grains_move_and_spend_none_on_settling():
    chosen = FILM.chosen(12)
    assert not {*range(5, 9), *range(50, 99)} & set(chosen)
    steps = np.diff([i for i in chosen if 10 <= i < 50])
    assert len(steps) >= 6 and steps.max() - steps.min() <= 1


def test_the_picture_begins_filled_and_ends_at_rest():
    first, second, third, last = FILM.moments()
    assert (first, last) == (9, 99) and 9 < second < third < 50


def test_a_film_in_which_nothing_moves_has_its_two_ends():
    still = film([0, 0, 1, 1], [0.1, 0.2, 0.3, 0.4], [0, 0, 0, 0])
    assert {1, 3} <= set(still.chosen(40)) and still.moments()[0] == 1


def write(path, **changes):
    one = dict(
        stage=0, time=0.1, ids=np.arange(3), clumps=np.arange(3), centres=np.zeros((3, 3)),
        radii=np.ones(3), speeds=np.ones(3), facets=np.zeros((2, 3, 3)), planes=np.zeros((0, 2)),
    )  # fmt: skip
    np.savez(path, **{**one, **changes})
    return path


def test_a_snapshot_is_read_as_it_was_written(tmp_path):
    shot = read_snapshot(write(tmp_path / "0_1.npz", centres=np.arange(9.0).reshape(3, 3)))
    assert (shot.stage, shot.time) == (0, 0.1) and shot.ids.dtype.kind == "i"
    np.testing.assert_array_equal(shot.centres, np.arange(9.0).reshape(3, 3))


@pytest.mark.parametrize(
    "changes",
    [
        {"centres": np.zeros((3, 2))},
        {"centres": np.zeros((4, 3))},
        {"radii": np.array([1, np.nan, 1])},
        {"time": np.array(["a"])},
        {"facets": np.zeros((2, 3))},
    ],
    ids=["flat", "more centres than radii", "no number", "text", "no corners"],
)
def test_a_damaged_snapshot_is_one_line_with_a_remedy(tmp_path, changes):
    with pytest.raises(CalibratorError, match=r"is damaged .*delete its folder"):
        read_snapshot(write(tmp_path / "0_1.npz", **changes))
    (tmp_path / "0_1.npz").write_bytes(b"PK")
    with pytest.raises(CalibratorError, match="is damaged"):
        read_snapshot(tmp_path / "0_1.npz")


def test_a_run_that_ended_while_it_was_filled_has_no_film(tmp_path):
    write(tmp_path / "0_1.npz")
    with pytest.raises(CalibratorError, match="choose another run"):
        Film.read(tmp_path)
