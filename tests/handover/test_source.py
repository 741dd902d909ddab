"""What is copied from the scripts is there word for word, with all that it needs."""

import ast
import builtins

import pytest

from calibrator.case.vocabulary import SCRIPTS
from calibrator.handover import yade
from calibrator.handover.source import copied
from tests.handover.materials import material

ON = dict(bond_number=0.5, wall_friction_ratio=0.5, twisting_stiffness=1.0, size_spread=0.2)


def functions(text):
    return {n.name: ast.dump(n) for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)}


def test_every_function_of_the_law_is_that_of_the_scripts():
    text = yade.text(material(**ON))
    ours = functions((SCRIPTS / "material.py").read_text())
    theirs = functions(text)
    shared = theirs.keys() & ours.keys()
    assert {"materials", "contact_functors", "dispatch", "time_step"} <= shared
    assert all(theirs[name] == ours[name] for name in shared)
    effects = set(yade.AT_START.values())
    assert theirs.keys() - ours.keys() - effects == {"add_materials", "contact_loop", "engines"}
    assert effects <= theirs.keys()


@pytest.mark.parametrize("values", [{}, ON, dict(rolling_spring="epsd")])
def test_an_exported_module_defines_every_name_that_it_uses(values):
    tree = ast.parse(yade.text(material(**values)))
    used = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    bound = {
        n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    }
    bound |= {n.arg for n in ast.walk(tree) if isinstance(n, ast.arg)}
    bound |= {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
    bound |= {a.asname or a.name for n in ast.walk(tree) if hasattr(n, "names") for a in n.names}
    assert used - bound - set(dir(builtins)) == set()


def test_a_constant_keeps_the_comment_above_it(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("# what it is\nA = 1\nB = 2\n\n\n@wrapped\ndef f():\n    return A\n")
    assert copied(script, ["f"]) == "# what it is\nA = 1\n\n\ndef f():\n    return A\n"
    with pytest.raises(KeyError):
        copied(script, ["g"])
