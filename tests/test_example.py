"""The example for Python users in the package's docstring and in the README."""

import re
import subprocess
import sys
from pathlib import Path

import calibrator

REPO = Path(__file__).resolve().parent.parent


def test_the_example_of_the_package_calibrates_the_demo_from_its_shipped_runs(tmp_path):
    example = re.search(r"    import calibrator\n(?:    .*\n)+", calibrator.__doc__).group()
    lines = [line.strip() for line in example.splitlines()]
    assert len(lines) == 5
    code = "\n".join(lines).replace('"cases/', f'"{REPO}/cases/')
    found = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "'rolling_friction': 0.2" in found.stdout and "front members" in found.stdout


def test_every_public_name_is_there_and_importing_the_package_imports_no_search():
    for name in calibrator.__all__:
        assert getattr(calibrator, name)
    code = "import calibrator, sys; sys.exit(any(m in sys.modules for m in ('numpy', 'pymoo')))"
    subprocess.run([sys.executable, "-c", code], check=True)
