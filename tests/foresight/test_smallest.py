"""`check` warns of vessels too small for what is measured in them, by the numbers of the page."""

import json
from pathlib import Path

import pytest

from benchmarks.numerics.measurement_page import BLOCKS, PAGE, filled
from calibrator.case.toml import read_case
from calibrator.check import check_case
from calibrator.foresight.smallest import LEAST, heap_height
from calibrator.runs.workspace import Workspace

ROOT = Path(__file__).resolve().parents[2]
EQUIVALENT = "pile_equivalent_angle_deg"
RESULTS = ROOT / "benchmarks" / "results"
BEADS = """setup,response,value,scatter,replicates,unit,role
conical_pile,pile_angle_of_repose_deg,23,0.8,5,deg,calibrate
hourglass,bulk_density,1500,6,5,kg/m3,calibrate
hourglass,mass_flow_rate,0.035,0.001,10,kg/s,calibrate
conical_pile,pile_equivalent_angle_deg,23,0.5,5,deg,held_out
"""
AS_THE_DEMO = (  # the vessels of cases/coarse_sand.toml
    ("cylinder_diameter = 34e-3", "cylinder_diameter = 24e-3"),
    ("fill_height = 29e-3", "fill_height = 20e-3"),
    ("lift_speed = 5e-3", "lift_speed = 40e-3"),
    ("lift_height = 22e-3", "lift_height = 15e-3"),
)


def of_vessels(found):
    return [w for w in found.warnings if any(least.seen in w for least in LEAST.values())]


def test_glass_beads_on_a_heap_of_the_demos_size_are_warned_of(checked):
    """Such a calibration has ended with a sliding friction of 0.58."""
    heap, lift = of_vessels(checked(*AS_THE_DEMO, lab=BEADS))
    keys = "conical_pile.pile_angle_of_repose_deg, conical_pile.pile_equivalent_angle_deg: "
    assert heap.startswith(f"{keys}such a heap is 5.8 grain diameters high, below 8: ")
    assert "cylinder_diameter = 0.034, fill_height = 0.028" in heap
    assert "core-seconds a run instead of" in heap and "give the equivalent angle" in heap
    assert lift.startswith(f"{keys}the lift has 0.29 sqrt(g d), above 0.04: ")
    assert "give lift_speed = 0.0056" in lift


def test_beads_that_are_measured_as_the_page_says_are_not_warned_of(checked):
    assert of_vessels(checked(lab=BEADS)) == []


def test_what_a_warning_says_to_give_is_not_warned_of_again(checked):
    small = (*AS_THE_DEMO, ("neck_diameter = 16e-3", "neck_diameter = 10e-3"))
    lab = BEADS + (
        "ledge,ledge_angle_of_repose_deg,30,1,5,deg,held_out\n"
        "hourglass,drained_angle_of_repose_deg,30,1,5,deg,held_out\n"
        "hourglass,discharge_time,1.5,0.1,5,s,held_out\n"
    )
    narrow = ("cylinder_diameter = 30e-3", "cylinder_diameter = 28e-3")
    kinds = {w.split(": ")[1] for w in of_vessels(checked(*small, narrow, lab=lab))}
    assert len(kinds) == 7, kinds
    larger = (
        *((old, f"{old.split(' = ')[0]} = {new}") for old, new in (
            ("neck_diameter = 16e-3", "16e-3"), ("box_length = 30e-3", "40e-3"),
            ("cylinder_diameter = 30e-3", "80e-3"), ("fill_mass = 20e-3", "150e-3"),
        )),
    )  # fmt: skip
    assert of_vessels(checked(*larger, lab=lab)) == []


def test_rough_grains_need_a_wider_neck_than_others(checked):
    narrow = ("neck_diameter = 16e-3", "neck_diameter = 14e-3")
    (warning,) = of_vessels(checked(narrow, lab=BEADS))
    assert "the neck has 7 grain diameters, below 7.7" in warning and "lower the bounds" in warning
    assert of_vessels(checked(narrow, ("high = 0.45", "high = 0.3"), lab=BEADS)) == []


def test_a_small_vessel_that_only_a_diagnosis_uses_is_left_alone(checked):
    lab = BEADS.replace("calibrate", "diagnose", 1).replace("held_out", "diagnose")
    assert of_vessels(checked(*AS_THE_DEMO, lab=lab)) == []


def test_the_height_of_a_heap_is_that_of_its_cone():
    """684 grains of 2 mm at 23 degrees, packed at 0.57: by the volume of a cone, written out."""
    assert heap_height(684, 23) == pytest.approx((684 * 0.42447**2 / 1.14) ** (1 / 3), rel=1e-3)


def test_a_friction_that_no_target_shows_is_warned_of(checked):
    lab = "\n".join(line for line in BEADS.splitlines() if "hourglass" not in line) + "\n"
    words = "parameters.sliding_friction: every target is an angle"
    assert any(w.startswith(words) for w in checked(lab=lab).warnings)
    assert not any(w.startswith(words) for w in checked(lab=BEADS).warnings)


def test_a_restitution_that_nobody_gave_is_warned_of(checked):
    warnings = checked(("restitution = 0.8\n", "")).warnings
    assert any("does not give restitution, the default 0.9 stands in" in w for w in warnings)


@pytest.mark.parametrize("name", ["coarse_sand", "missing_effect", "quartz_sand_full"])
def test_shipped_cases_are_warned_of_and_accepted(name, tmp_path, fake_yade):
    assert of_vessels(check_case(Workspace(read_case(ROOT / f"cases/{name}.toml"), tmp_path)))


def test_the_page_has_the_numbers_of_the_table_and_of_the_runs():
    page = PAGE.read_text()
    assert filled(page) == page, "call python -m benchmarks.numerics.measurement_page"
    assert page.count("<!-- end -->") == len(BLOCKS)


def test_what_the_table_says_was_seen_is_what_was_seen():
    """Rounded as in the sentences: a run more that changes one of them fails here."""
    found = json.loads((RESULTS / "smallest_vessels.json").read_text())
    heaps, ledges, craters = found["heaps"], found["ledges"], found["craters"]
    low = [heaps["0 to 3"], heaps["3 to 4"], heaps["4 to 6"]]
    sizes = found["heap_sizes"]
    flat, steep = (
        sizes[f"0.327, 0.429, {n} grains, 10 mm/s"][EQUIVALENT]["mean"] for n in (855, 6840)
    )
    lifts = {
        (pair, v): sizes[f"{pair}, 684 grains, {v} mm/s"][EQUIVALENT]["mean"]
        for pair, v in (("0.1, 0.3", 40), ("0.1, 0.3", 10), ("0.1, 0.3", 5), ("0.4, 0.7", 40),
                        ("0.4, 0.7", 10))
    }  # fmt: skip
    wide = [craters[k] for k in ("0 to 3.5", "3.5 to 4.2", "4.2 to 7")]
    gaps = [-one["fitted_minus_equivalent"] for one in wide]
    scatters = [one["scatter_fitted"] for one in wide]
    necks = {k: (v["clogged"], v["runs"]) for k, v in found["necks"].items()}
    rough = [necks[f"{k}, rough"] for k in ("6.5 to 7.1", "7.1 to 7.7", "7.7 to 12")]
    least = [necks[f"6 to 6.5, {k}"] for k in ("rough", "others")]
    times = {n: [100 * one[n] for one in found["times"].values()] for n in ("mass_flow_rate",
             "emptying_time", "discharge_time")}  # fmt: skip
    density = [sizes[f"0.327, 0.429, {n} grains, 10 mm/s"]["bulk_density"]["mean"]
               for n in (855, 2886, 6840)]  # fmt: skip
    said = {
        "heap": (f"{-min(h['lowest'] for h in low):.1f} degrees below to"
                 f" {max(h['highest'] for h in low):.1f} above", f"{steep - flat:.1f} degrees"),
        "lift": tuple(f"at {angle:.0f} " for angle in lifts.values()),
        "ledge": tuple(f"{ledges[k][n]:.1f}" for k in ("0 to 13", "13 to 16")
                       for n in ("scatter_fitted", "scatter_equivalent")),
        "crater": (f"{min(gaps):.0f} to {max(gaps):.0f} degrees below",
                   f"{min(scatters):.0f} to {max(scatters):.0f} between"),
        "neck": (f"{sum(c for c, _ in least)} of {sum(n for _, n in least)} runs",),
        "rough neck": (f"{rough[0][0] + rough[1][0]} of {rough[0][1] + rough[1][1]} runs",
                       f"{rough[2][0]} of {rough[2][1]} above"),
        "discharge": tuple(f"{min(v):.0f} to {max(v):.0f}" for v in times.values()),
        "width": tuple(f"{100 * (1 - d / density[2]):.1f} %" for d in density[:2]),
    }  # fmt: skip
    assert said.keys() == LEAST.keys()
    for kind, words in said.items():
        for word in words:
            assert word in LEAST[kind].seen, (kind, word)
    largest = heaps["8 to 20"]
    assert largest["lowest"] > -1 and largest["highest"] < 1
