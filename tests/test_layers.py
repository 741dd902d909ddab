"""Imports run downwards only, heavy libraries have one home, and the two Pythons never meet."""

import ast
from pathlib import Path

REPO = Path(__file__).resolve().parent.parent
FLOORS = [
    ["ground"],
    ["case"],
    ["runs", "laboratory"],
    ["responses"],
    ["plan"],
    ["search", "diagnosis"],
    ["verification", "foresight"],
    ["view"],
    ["check", "demo", "first_case", "report", "terminal"],
    ["handover", "verbs"],
    ["options"],
    ["cli", "summary"],
]
GROUND = {"errors", "files", "threads"}  # single modules that everything may use
FENCED = {
    "pymoo": {"search.nsga2"},
    "moocore": {"search.nsga2"},
    "matplotlib": {"report.figures", "view.drawing", "view.animation"},
    "subprocess": {"runs.local", "runs.slurm", "runs.programs"},
    "sklearn": {"responses.gaussian_process", "responses.kernel", "responses.success"},
    "threadpoolctl": {"threads"},
    "pandas": {"runs.database"},
    "skimage": {"laboratory.picture"},
}


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from (
                [node.module]
                if node.module != "calibrator"
                else [f"calibrator.{a.name}" for a in node.names]
            )
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def modules():
    """Path of every module by its dotted name below calibrator, without the packages' own."""
    root = REPO / "calibrator"
    return {
        ".".join(p.relative_to(root).with_suffix("").parts): p
        for p in root.rglob("*.py")
        if p.name != "__init__.py"
    }


def own_imports(path):
    """The modules below calibrator that a file imports."""
    known = modules()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "calibrator":
            base = node.module.removeprefix("calibrator").removeprefix(".")
            for alias in node.names:
                inner = f"{base}.{alias.name}".removeprefix(".")
                if inner in known or base in known:
                    yield inner if inner in known else base


def room(module):
    first = module.split(".")[0]
    return "ground" if first in GROUND else first


def test_every_room_has_a_floor_and_imports_run_downwards_only():
    floor = {name: i for i, row in enumerate(FLOORS) for name in row}
    assert {room(module) for module in modules()} == set(floor)
    for module, path in modules().items():
        for below in own_imports(path):
            if room(below) != room(module):
                assert floor[room(below)] < floor[room(module)], f"{module} imports {below}"


def test_no_circle_of_imports_within_a_room():
    graph = {module: set(own_imports(path)) for module, path in modules().items()}
    while ends := [module for module, below in graph.items() if not below & graph.keys()]:
        for module in ends:
            del graph[module]
    assert not graph, f"in a circle, or above one: {sorted(graph)}"


def test_the_tour_of_the_design_names_the_floors_as_they_are():
    line = " -> ".join(", ".join(row) for row in reversed(FLOORS))
    assert line in " ".join((REPO / "DESIGN.md").read_text().split())


def test_heavy_libraries_are_imported_in_one_module_or_room_each():
    for module, path in modules().items():
        for name in imports(path):
            allowed = FENCED.get(name.split(".")[0])
            homes = {module, module.rpartition(".")[0]}
            assert allowed is None or homes & allowed, f"{module} imports {name}"


def test_the_yade_side_uses_yade_numpy_and_the_standard_library_only():
    import sys

    own = {p.stem for p in (REPO / "yade_scripts").glob("*.py")}
    for path in (REPO / "yade_scripts").rglob("*.py"):
        for module in imports(path):
            top = module.split(".")[0]
            assert top in own | {"yade", "numpy"} or top in sys.stdlib_module_names, (
                f"{path.name} imports {module}"
            )


def test_the_measurements_can_be_imported_without_yade():
    for name in ("measure", "packing", "contract"):
        assert not any(m.startswith("yade") for m in imports(REPO / "yade_scripts" / f"{name}.py"))
