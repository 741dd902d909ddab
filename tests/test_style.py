"""What no linter here holds: lengths of lines, functions and files, and few untyped tables."""

import ast
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parent.parent
FOLDERS = ("calibrator", "yade_scripts", "tests", "benchmarks", "cases", "delivery", "docs")
FILES = sorted(path for folder in FOLDERS for path in (REPO / folder).rglob("*.py"))
LONGEST_LINE, LONGEST_FUNCTION, LONGEST_FILE = 100, 50, 350
UNTYPED_TABLES = 8  # in calibrator: JSON and TOML are read somewhere, and become values at once


def named(path):
    return str(path.relative_to(REPO))


def functions(path):
    """Name and number of lines of every function, its docstring counted, its decorators not."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, node.end_lineno - node.lineno + 1


def test_there_are_files_in_every_folder():
    """Else the tests below would pass whatever they hold."""
    assert {path.relative_to(REPO).parts[0] for path in FILES} == set(FOLDERS)


@pytest.mark.parametrize("path", FILES, ids=named)
def test_lines_functions_and_files_are_short(path):
    lines = path.read_text().splitlines()
    long = [i for i, line in enumerate(lines, 1) if len(line) > LONGEST_LINE]
    assert not long, f"lines of more than {LONGEST_LINE} columns"
    assert len(lines) <= LONGEST_FILE
    assert not {name: size for name, size in functions(path) if size > LONGEST_FUNCTION}


def test_few_tables_have_values_of_any_type():
    package = [path for path in FILES if path.is_relative_to(REPO / "calibrator")]
    found = {named(path): path.read_text().count("dict[str, Any]") for path in package}
    assert sum(found.values()) <= UNTYPED_TABLES, {k: n for k, n in found.items() if n}
