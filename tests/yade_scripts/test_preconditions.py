"""What `calibrator check` refuses of a geometry is what the scripts refuse, in the same words.

The scripts need YADE's interpreter, so that their conditions are taken from their source.
"""

import ast
import random
from types import SimpleNamespace

import pytest

from calibrator.case.vocabulary import SCRIPTS, SETUPS, parameters_of
from calibrator.runs.setups import impossible

REFUSING = {"hourglass": 2, "ledge": 1, "rotating_drum": 2, "effects": 1, "packing": 1}
"""Places in each script that refuse parameters; the contract's own are those of single values."""


class BadInput(ValueError):
    """As the contract has it."""


def tree(script):
    return ast.parse((SCRIPTS / f"{script}.py").read_text())


def refusals(script):
    return [
        node
        for node in ast.walk(tree(script))
        if isinstance(node, ast.Raise) and "BadInput" in ast.unparse(node)
    ]


def condition(setup):
    """A script's check(p), without the rest of the script; one that refuses nothing if none."""
    own = [n for n in tree(setup).body if isinstance(n, ast.FunctionDef) and n.name == "check"]
    effects = [n for n in tree("effects").body if getattr(n, "name", "") == "true_neck"]
    names = {}
    exec(compile(ast.Module(effects, []), "effects", "exec"), names)
    names |= {"contract": SimpleNamespace(BadInput=BadInput), "effects": SimpleNamespace(**names)}
    exec(compile(ast.Module(own, []), setup, "exec"), names)
    return names.get("check", lambda p: None)


def refused(setup, p):
    try:
        condition(setup)(p)
    except BadInput as error:
        return [str(error)]
    return []


def test_every_place_where_a_script_refuses_parameters_is_known_here():
    """A condition that is added to a script has to be added to calibrator/runs/setups.py."""
    scripts = [p.stem for p in SCRIPTS.glob("*.py") if p.stem != "contract"]
    assert {s: len(refusals(s)) for s in scripts if refusals(s)} == REFUSING
    for setup in set(REFUSING) & set(SETUPS):
        (check,) = [n for n in tree(setup).body if getattr(n, "name", "") == "check"]
        inside = [n for n in ast.walk(check) if isinstance(n, ast.Raise)]
        assert len(inside) == REFUSING[setup], "a refusal outside check(p) is not compared below"


@pytest.mark.parametrize("setup", SETUPS)
def test_a_geometry_is_refused_here_where_the_script_refuses_it(setup):
    draw, seen = random.Random(1), set()
    defaults = {n: q.default for n, q in parameters_of(setup).items() if q.unit != "token"}
    lengths = [n for n, q in parameters_of(setup).items() if q.unit == "m" and q.default]
    for _ in range(3000):
        p = {**defaults, **{n: 10 ** draw.uniform(-3.5, -1.5) for n in lengths}}
        if "neck_error" in p:
            p["neck_error"] = draw.choice([0.0, 1e-3, -1e-3])
        if "rotation_rpm" in p:
            p["rotation_rpm"] = draw.choice([60.0, 20.0])
        words = refused(setup, p)
        here = [w for w in impossible(setup, p) if not w.startswith("no grain fits")]
        assert here == words, p
        seen.update(words)
    assert len(seen) == REFUSING.get(setup, 0)


def test_effects_that_exclude_each_other_are_refused_in_the_scripts_words():
    (place,) = refusals("effects")
    (words,) = [n.value for n in ast.walk(place) if isinstance(n, ast.Constant) and "%s" in n.value]
    p = {n: q.default for n, q in parameters_of("ledge").items() if q.unit != "token"}
    found = impossible("ledge", {**p, "size_spread": 0.1, "clump_aspect": 1.2})
    assert found == [words % ("clump_aspect", "size_spread")]
