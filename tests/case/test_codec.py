"""One codec for tables of a case and for outcomes: what goes out comes back."""

from dataclasses import dataclass, field

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calibrator.case.codec import build, finite, plain, schema_of
from calibrator.errors import CalibratorError


@dataclass(frozen=True)
class Part:
    """A part of a whole."""

    DERIVED = ("double",)

    size: float
    count: int = 1

    @property
    def double(self) -> float:
        """Twice the size."""
        return 2 * self.size


@dataclass(frozen=True)
class Whole:
    """All that the codec can write."""

    name: str
    good: bool
    parts: tuple[Part, ...]
    pair: tuple[float, float]
    by_name: dict[str, Part] = field(default_factory=dict)
    maybe: float | None = None
    value: float | int | str = 0


NUMBERS = st.floats(-1e300, 1e300)
PARTS = st.builds(Part, NUMBERS, st.integers())
WHOLES = st.builds(
    Whole,
    st.text(),
    st.booleans(),
    st.lists(PARTS, max_size=3).map(tuple),
    st.tuples(NUMBERS, NUMBERS),
    st.dictionaries(st.text(), PARTS, max_size=3),
    st.none() | NUMBERS,
    NUMBERS | st.integers() | st.text(),
)


@given(WHOLES)
def test_what_is_written_is_read_back_and_follows_its_schema(whole):
    written = plain(whole)
    assert build(Whole, written, "whole") == whole
    jsonschema.validate(written, schema_of(Whole))


def test_derived_properties_are_written_and_not_read():
    assert plain(Part(2.0)) == {"size": 2.0, "count": 1, "double": 4.0}
    assert build(Part, {"size": 2.0, "double": 9.0}, "part") == Part(2.0)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"name": 1}, "whole.name = 1: give a value of type str"),
        ({"good": 1}, "whole.good = 1: give a value of type bool"),
        ({"parts": [{"size": "x"}]}, "whole.parts.size = 'x': give a value of type float"),
        ({"pair": [1.0]}, "whole.pair"),
        ({"maybe": "none"}, "type float or NoneType"),
        ({"nome": "x"}, "did you mean name"),
        ({"by_name": []}, "whole.by_name"),
        ({"parts": [{}]}, r"\[whole.parts\] is incomplete"),
        ({"value": True}, "whole.value = True"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_place(change, why):
    good = plain(Whole("x", True, (Part(1.0),), (0.0, 1.0)))
    with pytest.raises(CalibratorError, match=why):
        build(Whole, {**good, **change}, "whole")


def test_an_array_comes_back_with_nan_where_json_has_null():
    @dataclass(frozen=True, eq=False)
    class Arrays:
        """Some numbers."""

        values: np.ndarray

    written = plain(Arrays(np.array([[1.0, np.nan], [np.inf, 2.0]])))
    assert written == {"values": [[1.0, None], [None, 2.0]]}


def test_a_number_that_is_none_is_never_written():
    with pytest.raises(ValueError, match="no number"):
        plain(Part(float("nan")))
    assert finite(float("inf")) is None and finite(1.5) == 1.5
