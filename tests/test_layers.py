"""Imports run downwards only, heavy libraries live in one module each, and the two Pythons never meet."""

import ast
from pathlib import Path

REPO = Path(__file__).resolve().parent.parent
LAYERS = [
    ["errors", "threads"],
    ["files", "discrepancy", "surface"],
    ["quantities"],
    ["problem"],
    ["lab", "design", "table"],
    ["case", "records"],
    ["database", "interpolation", "verification", "identification"],
    ["objectives", "multilinear", "gaussian_process"],
    ["coordinates"],
    ["cost", "nsga2", "selection", "identifiability", "sensitivity"],
    ["plan", "runner", "adaptive"],
    ["cluster", "verdict", "experiments"],
    ["workspace"],
    ["plan_runs", "diagnosis_runs"],
    ["workflow", "sentences", "preflight"],
    ["diagnosis"],
    ["plot"],
    ["page", "scenes", "plot_diagnosis"],
    ["findings", "diagnosis_page"],
    ["report_calibration", "report_runs"],
    ["report"],
    ["cli"],
]
FENCED = {
    "pymoo": {"nsga2"},
    "moocore": {"nsga2"},
    "matplotlib": {"plot"},
    "subprocess": {"runner", "cluster"},
    "sklearn": {"gaussian_process"},
    "threadpoolctl": {"threads"},
    "pandas": {"database"},
}


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from ([node.module] if node.module != "calibrator" else [f"calibrator.{a.name}" for a in node.names])
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_every_module_has_a_layer_and_imports_only_lower_ones():
    rank = {name: i for i, layer in enumerate(LAYERS) for name in layer}
    modules = {p.stem: p for p in (REPO / "calibrator").glob("*.py") if p.stem != "__init__"}
    assert set(modules) == set(rank)
    for name, path in modules.items():
        for module in imports(path):
            if module.startswith("calibrator.") and module != "calibrator.__version__":
                below = module.split(".")[1]
                assert rank[below] < rank[name], f"{name} imports {below}"


def test_heavy_libraries_are_imported_in_one_module_each():
    for path in (REPO / "calibrator").glob("*.py"):
        for module in imports(path):
            allowed = FENCED.get(module.split(".")[0])
            assert allowed is None or path.stem in allowed, f"{path.stem} imports {module}"


def test_the_yade_side_uses_yade_numpy_and_the_standard_library_only():
    import sys

    own = {p.stem for p in (REPO / "yade_scripts").glob("*.py")}
    for path in (REPO / "yade_scripts").glob("*.py"):
        for module in imports(path):
            top = module.split(".")[0]
            assert top in own | {"yade", "numpy"} or top in sys.stdlib_module_names, f"{path.name} imports {module}"


def test_the_measurements_can_be_imported_without_yade():
    for name in ("measure", "packing", "contract"):
        assert not any(m.startswith("yade") for m in imports(REPO / "yade_scripts" / f"{name}.py"))
