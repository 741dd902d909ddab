"""The data dictionary is what the contract and the code say."""

from calibrator.case.vocabulary import PARAMETERS, RESPONSES
from calibrator.runs.database import LEADING, TRAILING
from docs.make_dictionary import COLUMNS, PAGE, page


def test_the_page_is_made_from_the_contract():
    assert PAGE.read_text() == page(), "call python -m docs.make_dictionary"


def test_every_name_is_on_it():
    text = page()
    for name in (*PARAMETERS, *RESPONSES, *LEADING, *TRAILING):
        assert f"| `{name}` |" in text
    assert set(COLUMNS) == {*LEADING, *TRAILING}
