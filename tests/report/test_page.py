"""The report page: complete, self-contained, honest about what is missing.

The runs are made up; no YADE is started.
"""

import base64
import csv
import dataclasses
import io
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from calibrator.errors import CalibratorError
from calibrator.plan.requests import plan_requests
from calibrator.report.findings import Findings
from calibrator.report.page import Page, write_report
from calibrator.report.seen import beside
from calibrator.report.words import number, short
from calibrator.report.words import text as escaped
from calibrator.report.words import words as in_words
from calibrator.runs.workspace import Workspace
from calibrator.search.calibrate import calibrate
from calibrator.search.outcome import arrays_path, current_calibration
from calibrator.verification.outcome import Verification
from tests.conftest import LAB
from tests.report.made_up import calibrated, finished, workspace
from tests.report.outline import Outline


@pytest.fixture
def copy(whole, tmp_path):
    """The same workspace, free to be changed."""
    shutil.copytree(whole[0].path, tmp_path / "results")
    return Workspace(whole[0].case, tmp_path / "results")


def test_the_page_needs_nothing_but_itself(whole):
    _, outcome, page = whole
    outline = Outline(page)
    assert not [tag for tag, _ in outline.tags if tag in ("script", "link", "iframe", "object")]
    assert not outline.outside("figures")
    assert "url(" not in page and "@import" not in page
    assert outcome.figures


def test_every_figure_of_the_folder_is_in_the_page_and_described(whole):
    space, outcome, page = whole
    files = sorted(str(p) for p in (space.path / "figures").glob("*.png"))
    assert sorted(map(str, outcome.figures)) == files
    images = [a for tag, a in Outline(page).tags if tag == "img"]
    assert len(images) == len(files) and all(len(a["alt"]) > 20 for a in images)
    for attributes in images:
        picture = Image.open(io.BytesIO(base64.b64decode(attributes["src"].split(",")[1])))
        assert picture.width > 300 and np.asarray(picture.convert("L")).std() > 5, "a blank picture"


def test_the_numbers_behind_every_figure_lie_beside_it_and_are_linked(whole):
    _, outcome, page = whole
    links = {a["href"] for tag, a in Outline(page).tags if tag == "a" and "/" in a["href"]}
    links = {one for one in links if one.endswith(".csv")}
    for path in outcome.figures:
        beside = path.with_suffix(".csv")
        rows = list(csv.reader(io.StringIO(beside.read_bytes().decode("utf-8-sig"))))
        assert f"figures/{beside.name}" in links and len(rows) > 1, beside.name
        assert {len(row) for row in rows} == {5}


def test_a_finished_calibration_gets_all_its_figures(whole):
    _, outcome, _ = whole
    names = {path.stem for path in outcome.figures}
    assert {f"packing_{s}" for s in ("hourglass", "ledge", "conical_pile")} <= names
    assert {f"profiles_{s}" for s in ("hourglass", "ledge", "conical_pile")} <= names
    assert {
        "slices_hourglass_bulk_density",
        "slices_hourglass_mass_flow_rate",
        "parity",
        "front_evolution",
    } <= names
    assert {
        "generational_distance",
        "profile_likelihood",
        "verification",
        "mass_time_hourglass",
    } <= names


def test_every_target_and_every_candidate_is_named(whole):
    space, outcome, page = whole
    text = Outline(page).text
    for words in (
        "bulk density (hourglass)",
        "drained equivalent angle (hourglass)",
        "mass flow rate (hourglass)",
    ):
        assert words in text
    assert (
        "ledge equivalent angle (ledge)" in text and "pile equivalent angle (conical pile)" in text
    )
    headings = re.findall(r"<th[^>]*>([^<]*)</th>", page)
    for label in current_calibration(space).candidates:
        assert headings.count(short(label)) >= 2, label
    assert "compromise" not in headings
    assert space.outcome("report", Page) == outcome


def test_the_answer_gives_values_intervals_and_the_verdict(whole):
    space, _, page = whole
    answer = re.search(r'<p class="answer">(.*?)</p>', page, re.DOTALL).group(1)
    for profile in current_calibration(space).identifiability.parameters:
        assert escaped(in_words(profile.name)) in answer
        assert number(profile.interval_95[0], 3) in answer
    assert (
        "<b>Verified:</b>" in answer
        and "do not pin down</b> Young&#x27;s modulus" in answer
        and "synthetic" not in answer
    )


def test_after_calibrate_alone_the_page_names_the_commands_to_run(tmp_path):
    space = calibrated(workspace(tmp_path), curves=False)
    outcome = write_report(space)
    text = Outline((space.path / "report.html").read_text()).text
    assert (
        f"calibrator verify {space.case.path}" in text
        and f"calibrator validate {space.case.path}" in text
    )
    assert "not verified" in text and "Use " not in text and "Verified:" not in text
    first = (space.path / "report.html").read_text().partition("<table")[0]
    assert "<img" not in first and f"calibrator view {space.case.path}" in first
    for picture in ("hourglass", "ledge", "conical pile"):
        assert f"The picture of the {picture} is missing" in text
    names = "".join(map(str, outcome.figures))
    assert "parity" in names and "packing" not in names


def test_before_calibrate_there_is_no_report(tmp_path):
    with pytest.raises(CalibratorError, match="calibrator calibrate"):
        write_report(workspace(tmp_path))


def with_problem(space, **changes):
    """The same results, seen from a case whose problem has changed."""
    problem = dataclasses.replace(space.case.problem, **changes)
    return dataclasses.replace(space, case=dataclasses.replace(space.case, problem=problem))


def test_the_page_refuses_a_calibration_of_a_target_that_has_been_corrected(copy):
    first, *others = copy.case.problem.targets
    corrected = with_problem(
        copy, targets=(dataclasses.replace(first, value=1.1 * first.value), *others)
    )
    with pytest.raises(CalibratorError, match=r"targets changed since calibrate.*`calibrator cali"):
        write_report(corrected)
    calibrate(corrected)
    with pytest.raises(CalibratorError, match=r"changed since verify: run `calibrator verify"):
        write_report(corrected)


def test_the_page_refuses_a_validation_of_another_measurement(copy):
    corrected = with_problem(
        copy,
        held_out=tuple(dataclasses.replace(t, scatter=0.3) for t in copy.case.problem.held_out),
    )
    with pytest.raises(CalibratorError, match="targets changed since validate"):
        write_report(corrected)


def test_the_page_is_written_without_any_search(copy):
    code = (
        "import sys\n"
        "for name in ('pymoo', 'moocore', 'calibrator.search.nsga2', 'calibrator.search.calibrate',"
        " 'calibrator.search.identifiability', 'calibrator.search.reach'):\n"
        "    sys.modules[name] = None\n"
        "from pathlib import Path\n"
        "from calibrator.case.toml import read_case\n"
        "from calibrator.report.page import write_report\n"
        "from calibrator.runs.workspace import Workspace\n"
        f"write_report(Workspace(read_case({str(copy.case.path)!r}), Path({str(copy.path)!r})))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_arrays_of_another_calibration_are_refused(copy):
    path = arrays_path(copy)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(CalibratorError, match="run `calibrator calibrate"):
        write_report(copy)
    path.unlink()
    with pytest.raises(CalibratorError, match="run `calibrator calibrate"):
        write_report(copy)


def test_the_first_screen_shows_a_run_of_the_recommended_set_and_how_to_see_it_move(whole):
    space, _, page = whole
    first = page[: page.index("<table")]
    assert first.count("<img") == 1 and "Hourglass in YADE: 30 grains filled, 20" in first
    assert f"calibrator view {space.case.path}" in first
    verified = [r.run_id for r in Findings.of(space).verified["compromise"]]
    assert re.search(r"Run ([0-9a-f]{16}) with", first).group(1) in verified


def test_a_response_that_the_parameters_hardly_move_is_said_to_be_uninformative(tmp_path):
    density = "hourglass,bulk_density,1605.6,"
    space = workspace(tmp_path, lab=LAB.replace(f"{density}5,8", f"{density}400,1"))
    outcome = write_report(calibrated(space, curves=False))
    text = Outline((space.path / "report.html").read_text()).text
    assert "Bulk density (hourglass) is uninformative, and not drawn" in text
    drawn = {path.stem for path in outcome.figures if path.stem.startswith("slices")}
    assert drawn == {
        "slices_hourglass_drained_equivalent_angle_deg",
        "slices_hourglass_mass_flow_rate",
    }


def test_alternative_texts_state_what_the_figures_show(whole):
    space, _, page = whole
    said = [a["alt"] for tag, a in Outline(page).tags if tag == "img"]
    verified = space.outcome("verify", Verification).candidates["compromise"].responses
    off = next(r for r in verified if r.key == "hourglass.mass_flow_rate").relative_error
    assert any(
        f"simulated mass flow rate (hourglass) {beside(off)} the measured" in s for s in said
    )
    assert any("Interpolated bulk density (hourglass) at the recommended set is" in s for s in said)
    for words in (
        "sets on the Pareto front, from O1",
        "root mean square",
        "95 % intervals",
        "correlation",
        "of variance",
        "from generation",
    ):
        assert sum(words in s for s in said) == 1, words


def test_a_failed_verification_is_said_in_the_answer(tmp_path):
    angle = "hourglass,drained_equivalent_angle_deg,"
    space = workspace(tmp_path, lab=LAB.replace(f"{angle}46.8", f"{angle}80"))
    finished(space)
    write_report(space)
    page = (space.path / "report.html").read_text()
    assert "<b>Not verified:</b>" in page and "failed" in page
    assert re.search(
        r'class="alarm">The targets are out of reach\. Drained equivalent angle \(hourglass\) = 80'
        r" cannot",
        page,
    )


def test_what_a_user_writes_is_escaped(tmp_path):
    nasty = "<script src='http://x.y/z.js'></script> & <b>"
    change = ('measured = "lab.csv"', f'about = "{nasty}"\nmeasured = "lab.csv"')
    space = calibrated(workspace(tmp_path, change), curves=False)
    write_report(space)
    page = (space.path / "report.html").read_text()
    assert nasty not in page and page.count("&lt;script src=") == 2, (
        "once as the title, once in the case file"
    )
    assert not [tag for tag, _ in Outline(page).tags if tag == "script"]


def test_clogged_runs_are_counted_with_their_reason(tmp_path):
    space = calibrated(workspace(tmp_path), clogged=(2, 5), curves=False)
    write_report(space)
    text = Outline((space.path / "report.html").read_text()).text
    assert "grains came to rest above the open neck" in text
    assert all(plan_requests(space.case)[i].run_id in text for i in (2, 5))


def test_provenance_names_versions_scripts_case_and_cost(whole):
    space, _, page = whole
    text = Outline(page).text
    spent = len(list(csv.reader((space.path / "timings.csv").read_text().splitlines()))) - 1
    assert "2023.02a" in text and "abc123" in text and "scikit-learn" in text
    assert f"{3 * spent} in {spent} runs made here" in text
    assert "[parameters.rolling_friction]" in page


def test_the_same_results_give_the_same_page(whole, copy):
    write_report(copy)
    assert (copy.path / "report.html").read_text() == whole[2]


def test_the_truth_of_a_synthetic_lab_is_compared(tmp_path):
    (tmp_path / "truth.toml").write_text(
        "[parameters]\nrolling_friction = 0.25\nsliding_friction = 0.5\nyoung_modulus = 3e6\n"
    )
    change = ('measured = "lab.csv"', 'measured = "lab.csv"\ntruth_file = "truth.toml"')
    space = calibrated(workspace(tmp_path, change), curves=False)
    write_report(space)
    page = (space.path / "report.html").read_text()
    assert "The lab is synthetic" in page and "<th>truth</th>" in page
