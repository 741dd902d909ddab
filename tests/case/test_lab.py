"""A mistake in the lab file, in its conditions or in the nuisance table gets one line."""

import pytest

from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from tests.conftest import LAB
from tests.toy_laboratory import NUISANCES, SMALL, lab


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("1605.6", "nan", "give a finite value"),
        ("1605.6", "1.6 t", "plain numbers"),
        ("kg/m3", "g/cm3", "convert it to kg/m3"),
        ("bulk_density", "bulk_densiti", "did you mean bulk_density"),
        ("calibrate", "calibrated", "did you mean calibrate"),
        ("hourglass,mass_flow_rate", "ledge,mass_flow_rate", "does not measure"),
        ("role\n", "rolle\n", "header must be"),
        (",8,kg/s", ",0,kg/s", "replicates"),
        (
            "hourglass,mass_flow_rate,0.026,0.0001,8,kg/s",
            "hourglass,bulk_density,1,1,1,kg/m3",
            "more than once",
        ),
    ],
)
def test_a_mistake_in_the_lab_file_is_named_with_its_remedy(write_case, old, new, why):
    assert old in LAB
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case(lab=LAB.replace(old, new)))


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
    with pytest.raises(CalibratorError, match=r"lab.csv line 3: "):
        read_case(write_case(lab=LAB.replace(old, new)))


def test_the_words_of_a_file_that_is_no_lab_file_are_not_repeated(write_case, tmp_path):
    (tmp_path / "key.txt").write_text("the secret key\n")
    with pytest.raises(CalibratorError) as caught:
        read_case(write_case(('"lab.csv"', '"key.txt"')))
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (
            "balance,*mass_flow_rate,0.1,%",
            "balance,*mass_flow_rate,0.1,kg",
            "unit 'kg'; the error has to be in kg/s",
        ),
        ("balance,*mass_flow_rate,0.1,%", "balance,*mass_flow,0.1,%", "is the key of no row"),
        (
            "balance,*mass_flow_rate,0.1,%",
            "balance,*mass_flow_rate,-0.1,%",
            "give a positive standard deviation",
        ),
        ("effect:bed_viscosity", "effect:bed_viscocity", "did you mean bed_viscosity"),
    ],
)
def test_a_mistake_in_the_nuisance_table_is_named_with_its_remedy(
    write_case, tmp_path, old, new, why
):
    (tmp_path / "nuisances.csv").write_text(NUISANCES.replace(old, new))
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case(SMALL, lab=lab()))


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("hourglass,,late", "hourglass,narrow,late", "did you mean|use one of"),
        (
            "ledge,,bulk_density",
            "ledge,wide_neck,bulk_density",
            "the condition belongs to hourglass",
        ),
    ],
)
def test_a_mistake_with_conditions_is_named_with_its_remedy(write_case, tmp_path, old, new, why):
    (tmp_path / "nuisances.csv").write_text(NUISANCES)
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case(SMALL, lab=lab().replace(old, new)))
