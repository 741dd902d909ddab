"""The exported module inside YADE: the contact law of the scripts, formulas, and a heap."""

import ast
import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from calibrator.case.physics import GRAVITY
from calibrator.case.vocabulary import SCRIPTS
from calibrator.handover import contact, yade
from calibrator.runs.request import Request, write_table
from tests.handover.materials import material

HERE = Path(__file__).parent
SAND = dict(young_modulus=1e6, restitution=0.8, sliding_friction=0.8, rolling_friction=0.3)
VARIANTS = {
    "plain": SAND,
    "smooth": {**SAND, "rolling_friction": 0.0},
    "ratio": {**SAND, "rolling_stiffness_ratio": 1.0, "restitution": 0.5},
    "soft": {**SAND, "rolling_spring": "epsd", "particle_radius": 4e-4},
    "step": {**SAND, "time_step": 1e-5},
    "effects": {**SAND, "bond_number": 0.5, "wall_friction_ratio": 0.5, "twisting_stiffness": 1.0},
    "sizes": {**SAND, "size_spread": 0.2},
}
SMALL = dict(cylinder_diameter=14e-3, fill_height=12e-3, lift_speed=40e-3, lift_height=15e-3)

pytestmark = pytest.mark.yade


def call(script, folder, **environment):
    """Run YADE on a script in a folder."""
    if shutil.which("yade") is None:
        pytest.fail("yade is not on PATH: install the Debian package 'yade'", pytrace=False)
    done = subprocess.run(
        ["yade", "-n", "-x", "-j1", str(script)],
        cwd=folder,
        env={**os.environ, "EXPORTED": str(folder), **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )
    return done.stdout[-4000:]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """What scene_compared.py found in one process."""
    folder = tmp_path_factory.mktemp("exported")
    for name, values in VARIANTS.items():
        (folder / f"sand_{name}.py").write_text(yade.text(material(**values)))
    asked = {f"sand_{name}": values for name, values in VARIANTS.items()}
    (folder / "compared.json").write_text(json.dumps(asked))
    said = call(HERE / "scene_compared.py", folder)
    record = folder / "found.json"
    assert record.exists(), said
    return json.loads(record.read_text())


@pytest.mark.parametrize("name", VARIANTS)
def test_the_exported_law_is_that_of_the_scripts_to_the_bit(found, name):
    theirs, ours = found["laws"][f"sand_{name}"]
    assert theirs == ours
    assert (ours["moment"] and ours["grains"]["eta"] != ours["walls"]["eta"]) or name == "smooth"


def test_two_grains_have_the_cap_and_the_restitution_of_the_material(found):
    p = material(**SAND).numbers
    cap = 0.3 * p["particle_radius"] / 2 * 5 * contact.grain_mass(p) * GRAVITY
    assert found["cap"] == pytest.approx(cap, rel=0.01)
    assert found["restitution"] == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize("kind", ["wall", "facet"])
def test_a_grain_that_rolls_on_a_floor_is_slowed_by_mu_r(found, kind):
    assert found["rolling"][kind] == pytest.approx(5 / 7 * 0.3 * GRAVITY, rel=0.01)


@pytest.mark.parametrize("name", ["plain", "soft", "effects", "sizes", "ratio"])
def test_other_engines_get_springs_and_steps_from_the_formulas_of_the_scripts(found, name):
    """The other files' numbers come from calibrator.handover.contact, which cannot import them."""
    (_, ours), p = found["laws"][f"sand_{name}"], material(**VARIANTS[name]).numbers
    assert contact.yade_step(p) == pytest.approx(ours["dt"], rel=1e-12)
    if name == "sizes":
        return  # one spring for all pairs of sizes, which is no single contact's
    kind, r = VARIANTS[name].get("rolling_spring", "epsd2"), p["particle_radius"]
    for pair, r_eff in (("grains", r / 2), ("walls", r)):
        spring = contact.rolling_spring(p, kind, r_eff) * r_eff**2
        assert spring == pytest.approx(ours[pair]["krot"], rel=1e-12)


def test_the_example_of_the_document_runs_where_there_are_no_scripts(tmp_path):
    """The grain falls for a while, meets the wall, and is held by a contact of the wall's kind."""
    page = (HERE.parents[1] / "docs" / "export.md").read_text()
    (example,) = re.findall(r"^```python\n(import sys\n.*?)^```$", page, re.M | re.S)
    folder = tmp_path / "results" / "my_sand" / "export"
    folder.mkdir(parents=True)
    values = {**SAND, "particle_radius": 1e-3}
    (folder / "my_sand_yade.py").write_text(yade.text(material(**values)))
    ending = """
O.run(40000, True)
(contact,) = [i for i in O.interactions if i.isReal]
open("found.txt", "w").write(repr([O.bodies[1].state.pos[2], contact.phys.kr, O.dt]))
"""
    (tmp_path / "own.py").write_text(example + ending)
    said = call(tmp_path / "own.py", tmp_path)
    assert (tmp_path / "found.txt").exists(), said
    height, spring, dt = ast.literal_eval((tmp_path / "found.txt").read_text())
    p = material(**values).numbers
    assert dt == contact.yade_step(p)
    assert spring == pytest.approx(contact.rolling_spring(p, "epsd2", 1e-3) * 1e-6)
    weight = contact.grain_mass(p) * GRAVITY
    assert 1e-3 - height == pytest.approx(contact.overlap(p, 1e-3, weight), rel=0.02)


@pytest.mark.slow
def test_a_heap_by_the_exported_module_is_the_heap_of_the_scripts_to_the_bit(tmp_path):
    request, responses = Request.of("conical_pile", **SAND, **SMALL, seed=7), []
    write_table(tmp_path / "run.table", [request])
    (tmp_path / "sand_yade.py").write_text(yade.text(material(**SAND)))
    record = tmp_path / "records" / f"{request.run_id}.json"
    for script in (SCRIPTS / "conical_pile.py", HERE / "scene_heap.py"):
        said = call(script, tmp_path, MODULE="sand_yade", YADE_BATCH="run.table:2")
        assert record.exists(), said
        found = json.loads(record.read_text())
        assert found["status"] == "ok", found["error"]
        responses.append(found["responses"])
        record.unlink()
    assert responses[0] == responses[1]
