"""The numbers behind figures, on figures whose numbers are known."""

import csv
import io

import numpy as np
from matplotlib.figure import Figure

from calibrator.report.figures.data import HEAD, MOST, csv_of, rows_of


def drawn():
    """A figure of two panels, and its axes."""
    figure = Figure()
    return figure, figure.subplots(1, 2)


def test_lines_points_bands_bars_and_matrices_give_their_numbers():
    figure, (left, right) = drawn()
    left.set(xlabel="time [s]", ylabel="mass [g]")
    left.plot([0, 1], [2.5, 3.0], label="measured")
    left.axhline(4.0)
    left.scatter([7.0], [8.0])
    left.fill_between([0, 1], [1, 1], [2, 2])
    right.set_title("shares")
    right.barh([-0.2, 0.8], [0.3, 0.6], 0.4, label="alone")
    right.set_yticks([0, 1], ["rolling friction", "Young's modulus"])
    rows = rows_of(figure)
    panel = "mass [g] against time [s]"
    assert rows[:2] == [(panel, "measured", "0", "2.5", ""), (panel, "measured", "1", "3", "")]
    assert rows[2:4] == [(panel, "line", "", "4", "")] * 2
    assert (panel, "points", "7", "8", "") in rows
    band = [(float(r[2]), float(r[3])) for r in rows if r[1] == "edge of a band"]
    assert {(0, 1), (1, 1), (0, 2), (1, 2)} <= set(band)
    assert rows[-2:] == [
        ("shares", "alone", "0.3", "rolling friction", ""),
        ("shares", "alone", "0.6", "Young's modulus", ""),
    ]


def test_a_matrix_gives_its_values_and_a_picture_none():
    figure, (left, right) = drawn()
    left.imshow(np.array([[1.0, 2.0], [3.0, 4.5]]))
    right.imshow(np.zeros((2, 2, 3)))
    assert [row[2:] for row in rows_of(figure)] == [
        ("0", "0", "1"), ("1", "0", "2"), ("0", "1", "3"), ("1", "1", "4.5"),
    ]  # fmt: skip


def test_the_table_opens_in_a_spreadsheet_and_there_is_none_of_nothing():
    figure, (left, _) = drawn()
    assert csv_of(figure) == b""
    left.plot([0, 1], [np.nan, 2])
    lines = list(csv.reader(io.StringIO(csv_of(figure).decode("utf-8-sig"))))
    assert lines[0] == list(HEAD) and lines[1][2:] == ["0", "", ""] and lines[2][2:4] == ["1", "2"]
    left.plot(np.arange(MOST), np.arange(MOST))
    assert csv_of(figure) == b""
