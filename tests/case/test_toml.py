"""A mistake in a case file gets one line that says what to do."""

import pytest

from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError
from tests.conftest import LAB
from tests.toy_laboratory import SMALL, lab


def test_the_toy_case_is_read(write_case):
    case = read_case(write_case())
    assert case.problem.names == ["rolling_friction", "sliding_friction", "young_modulus"]
    assert [t.key for t in case.problem.held_out] == [
        "ledge.ledge_equivalent_angle_deg",
        "conical_pile.pile_equivalent_angle_deg",
    ]
    assert case.problem.targets[0].standard_error == pytest.approx(5 / 8**0.5)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("population", "popolation", "did you mean population"),
        ("[plan]", "[plann]", "did you mean plan"),
        (
            "[parameters.rolling_friction]",
            "[parameters.roling_friction]",
            "did you mean rolling_friction",
        ),
        ("low = 0.2", "low = 0.8", "is not below high"),
        ("low = 0.2", "low = 0.7", "both 0.7; give a wider interval, or move it to .fixed"),
        ("low = 0.2", "low = -0.2", "give a value from 0"),
        ("low = 0.2", "low = nan", "give a finite number"),
        ("low = 0.2", "low = '0.2'", "give a value of type float"),
        ("low = 0.2", "", "incomplete"),
        ("sets = 14", "sets = 0", "give 1 or more"),
        ("sets = 14", "sets = 1.5", "give a value of type int"),
        ('design = "sobol"', 'design = "sobel"', "did you mean sobol"),
        ('name = "toy"', 'name = "../toy"', "plain word"),
        ('measured = "lab.csv"', 'measured = "no.csv"', "no lab file"),
        ('name = "toy"', 'name = "toy', "not valid TOML"),
        ("[run]", "[fixed]\nrolling_friction = 0.1\n[run]", "both calibrated and fixed"),
        ("[run]", "[fixed]\nseed = 1\n[run]", "seed cannot be fixed"),
        (
            "[run]",
            "[setups.ledge]\nneck_diameter = 0.01\n[run]",
            "unknown parameter in .setups",
        ),
        (
            "[run]",
            '[targets."hourglass.bulk_densty"]\nweight = 1.0\n[run]',
            "did you mean hourglass.bulk_density",
        ),
    ],
)
def test_a_mistake_in_the_case_is_named_with_its_remedy(write_case, old, new, why):
    with pytest.raises(CalibratorError, match=why):
        read_case(write_case((old, new)))


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
    ("key", "change"),
    [
        ("measured", ('"lab.csv"', '"/etc/passwd"')),
        (
            "truth_file",
            ("[parameters.rolling", 'truth_file = "../../truth.toml"\n[parameters.rolling'),
        ),
        ("run.shipped", ("jobs = 1", 'shipped = "../../runs.csv"')),
        ("verify.shipped", ("[verify]", '[verify]\nshipped = "/tmp/runs.csv"')),
        ("validate.shipped", ("[verify]", '[validate]\nshipped = "a/../../runs.csv"\n[verify]')),
    ],
)
def test_every_key_that_names_a_file_is_held_to_that(write_case, key, change):
    with pytest.raises(CalibratorError, match=f"{key} = .* leaves the case's folder"):
        read_case(write_case(change))


def test_the_mark_of_an_editor_before_the_text_is_no_error(write_case, tmp_path):
    path = write_case()
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    (tmp_path / "lab.csv").write_bytes(b"\xef\xbb\xbf" + LAB.replace("\n", "\r\n").encode())
    assert len(read_case(path).problem.targets) == 3


def test_cluster_settings_with_two_values_or_shell_text_are_refused(write_case, tmp_path):
    path, site = write_case(("[run]", '[cluster]\npartition = "a"\n[run]')), tmp_path / "site.toml"
    site.write_text(
        '[cluster]\naccount = "sand"\nmodules = ["yade/2023.02"]\nshell = ["ulimit -c 0"]\n'
    )
    cluster = read_case(path, site).cluster
    assert (cluster.partition, cluster.account) == ("a", "sand")
    assert (cluster.modules, cluster.shell) == (("yade/2023.02",), ("ulimit -c 0",))
    for wrong in (
        'partition = "b"', 'account = "x; rm"', 'account = "x\\n"', 'time = "soon"',
        'memory = "-1"', 'modules = ["a; rm"]', 'modules = ["-f"]', "nodes = 2", "most_tasks = 0",
    ):  # fmt: skip
        site.write_text(f"[cluster]\n{wrong}\n")
        with pytest.raises(CalibratorError):
            read_case(path, site)


def test_a_case_that_somebody_sends_brings_no_shell_text(write_case):
    with pytest.raises(CalibratorError, match="move it to a site file"):
        read_case(write_case(("[run]", '[cluster]\nshell = ["rm -r x"]\n[run]')))


@pytest.mark.parametrize(
    ("scales", "message"),
    [
        ("bed_viscosity = 0.0", "above 0"),
        ("bed_viscosity = -1e-3", "above 0"),
        ("tilt_deg = 3.0", "diagnosis.scales"),
    ],
)
def test_a_size_that_cannot_be_is_refused(write_case, scales, message):
    with pytest.raises(CalibratorError, match=message):
        read_case(
            write_case(("[run]", f"{SMALL[1][:-5]}[diagnosis.scales]\n{scales}\n[run]"), lab=lab())
        )


def test_all_mistakes_of_case_and_lab_file_are_named_at_once(write_case):
    wrong = [
        ("population", "popolation"),
        ("low = 0.05", "low = 'x'"),
        ("sets = 14", "sets = 0"),
        ("replicates = 2", "replicates = 0"),
        ("[run]", "[fixed]\nrestitution = 7\n[setups.ledge]\nneck_diameter = 0.01\n[run]"),
    ]
    with pytest.raises(CalibratorError) as caught:
        read_case(write_case(*wrong, lab=LAB.replace("kg/m3", "g/cm3").replace("0.026", "x")))
    first, *lines = str(caught.value).splitlines()
    assert first == "8 mistakes:" and len(lines) == 8
    for words in (
        "search", "rolling_friction.low", "plan.sets", "plan.replicates", "restitution = 7",
        "setups.ledge", "line 3: bulk_density", "line 5: ",
    ):  # fmt: skip
        assert sum(words in line for line in lines) == 1, words
    assert all(line.startswith("  ") and line.isprintable() for line in lines)


def test_a_file_with_very_many_mistakes_is_not_shown_whole(write_case):
    keys = "".join(f"x{i} = 1\n" for i in range(100))
    with pytest.raises(CalibratorError) as caught:
        read_case(write_case(('name = "toy"', f'name = "toy"\n{keys}')))
    lines = str(caught.value).splitlines()
    assert len(lines) == 22 and lines[0] == "100 mistakes:" and "and 80 more" in lines[-1]
