"""Functions of the YADE scripts, copied word for word: one place defines them."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from pathlib import Path

from calibrator.files import read_text


def copied(path: Path, wanted: Iterable[str]) -> str:
    """Source of a script's functions and constants, with all of its own that they use.

    Word for word and in the script's order; a comment right above goes with what it is about.
    wanted : names at the top level of the script. Raises KeyError for one that is not there.
    """
    text = read_text(path)
    lines, tree = text.splitlines(), ast.parse(text)
    places = {name: node for node in tree.body for name in _defined(node)}
    open_, needed = [*wanted], set()
    while open_:
        name = open_.pop()
        if name not in needed:
            needed.add(name)
            open_ += sorted(_used(places[name]) & places.keys())
    chosen = [node for node in tree.body if needed & set(_defined(node))]
    blocks = [(isinstance(node, ast.FunctionDef), _block(lines, node)) for node in chosen]
    found = ""
    for function, block in blocks:
        found += ("\n\n" if function else "") + block + "\n"
    return found.strip("\n") + "\n"


def _used(node: ast.stmt) -> set[str]:
    """Names in a statement, without those of its decorators, which are not copied."""
    decorators = getattr(node, "decorator_list", [])
    parts = [part for part in ast.iter_child_nodes(node) if part not in decorators]
    return {n.id for part in parts for n in ast.walk(part) if isinstance(n, ast.Name)}


def _defined(node: ast.stmt) -> list[str]:
    """Names that a statement at the top level defines."""
    if isinstance(node, ast.FunctionDef):
        return [node.name]
    if isinstance(node, ast.Assign):
        return [n.id for t in node.targets for n in ast.walk(t) if isinstance(n, ast.Name)]
    return []


def _block(lines: list[str], node: ast.stmt) -> str:
    """A statement's lines without decorators, with the comments right above."""
    first = node.lineno - 1
    while isinstance(node, ast.Assign) and first and lines[first - 1].startswith("#"):
        first -= 1
    return "\n".join(lines[first : node.end_lineno])
