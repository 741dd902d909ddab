"""Everything that must hold before a release is published: `make release`.

It checks version, changelog and tag against each other, builds wheel and source archive into dist/,
checks and installs them, and says what is left to do. It uploads nothing, tags nothing and changes
no file of the project; dist/ is made anew.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

REPO = Path(__file__).resolve().parent.parent
NEXT = """\
left to do, by hand:
  git tag -s v{version} && git push origin main v{version}
  twine upload dist/*        # or attach both files to the release page of the tag
  then add "## Unreleased" to CHANGELOG.md and raise the version in calibrator/__init__.py\
"""


def ask(*command: str | Path, cwd: Path, **more: str) -> str:
    """The output of a program; RuntimeError, with what it said, where it fails."""
    own = {name: v for name, v in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, env={**own, **more}, capture_output=True, text=True
    )
    if done.returncode:
        said = (done.stderr.strip() or done.stdout.strip() or "nothing").splitlines()[-1]
        raise RuntimeError(f"{Path(command[0]).name} {' '.join(map(str, command[1:4]))}: {said}")
    return done.stdout.strip()


def version_of(repo: Path) -> str:
    """The version that the package has."""
    text = (repo / "calibrator" / "__init__.py").read_text()
    return re.search(r'^__version__ = "(.+?)"', text, re.M)[1]


def sections(changelog: str) -> dict[str, str]:
    """What a changelog says of each release, by its heading."""
    parts = re.split(r"^## (.+)$", changelog, flags=re.M)[1:]
    return {head.strip(): body.strip() for head, body in zip(parts[::2], parts[1::2], strict=True)}


def contradictions(repo: Path) -> list[str]:
    """What version, citation, changelog, tag and work tree say against each other."""
    version, found = version_of(repo), []
    if not re.fullmatch(r"\d+\.\d+\.\d+((a|b|rc)\d+)?", version):
        found.append(f"version {version} is none such as 1.2.3 or 1.2.3rc1")
    cited = re.search(r"^version: (.+)$", (repo / "CITATION.cff").read_text(), re.M)
    if cited is None or cited[1].strip() != version:
        found.append(f"CITATION.cff does not say version: {version}")
    log = sections((repo / "CHANGELOG.md").read_text())
    if log.get("Unreleased"):
        found.append(f'CHANGELOG.md: what is under "Unreleased" belongs under "{version} (date)"')
    heading = rf"{re.escape(version)} \(\d{{4}}(-\d\d){{2}}\)"
    dated = [head for head in log if re.fullmatch(heading, head)]
    if not dated or not log[dated[0]]:
        found.append(f'CHANGELOG.md has nothing under "## {version} (YYYY-MM-DD)"')
    if dirty := ask("git", "status", "--porcelain", cwd=repo):
        found.append(f"{len(dirty.splitlines())} files are not committed: `git status` names them")
    if ask("git", "tag", "--list", f"v{version}", cwd=repo):
        tagged = ask("git", "rev-list", "-n", "1", f"v{version}", cwd=repo)
        if tagged != ask("git", "rev-parse", "HEAD", cwd=repo):
            found.append(f"v{version} is the tag of another commit: raise the version")
    return found


def build(source: Path, target: Path, kinds: Sequence[str]) -> list[Path]:
    """Wheel ("wheel") and source archive ("sdist") of a tree, in a new folder."""
    flags = [word for kind in kinds for word in ("-t", kind)]
    ask(sys.executable, "-m", "hatchling", "build", *flags, "-d", target, cwd=source)
    return sorted(target.iterdir())


def faults(sdist: Path, wheel: Path, version: str, repo: Path) -> list[str]:
    """What is wrong with the files of a release."""
    found = []
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        about = archive.read(next(n for n in names if n.endswith(".dist-info/METADATA"))).decode()
    tops = {name.split("/")[0] for name in names if ".dist-info/" not in name}
    if tops != {"calibrator"}:
        found.append(f"{wheel.name} installs {', '.join(sorted(tops))}: one package is meant")
    if f"\nVersion: {version}\n" not in about or (repo / "README.md").read_text() not in about:
        found.append(f"{wheel.name}: version or description are not the project's")
    with tempfile.TemporaryDirectory() as scratch:
        shutil.unpack_archive(sdist, scratch)
        (tree,) = Path(scratch).iterdir()
        (again,) = build(tree, Path(scratch) / "dist", ["wheel"])
        if again.read_bytes() != wheel.read_bytes():
            found.append(f"{sdist.name} does not build the same wheel")
        found += _faults_installed(wheel, version, Path(scratch) / "environment")
    if shutil.which("twine"):
        try:
            ask("twine", "check", "--strict", sdist, wheel, cwd=repo)
        except RuntimeError as error:
            found.append(str(error))
    return found


def _faults_installed(wheel: Path, version: str, place: Path) -> list[str]:
    """Whether the wheel works in an environment of its own, with this one's dependencies."""
    ask(sys.executable, "-m", "venv", "--without-pip", place, cwd=wheel.parent)
    python = place / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "--disable-pip-version-check")
    ask(*pip, "install", "-q", "--no-deps", "--no-index", wheel, cwd=wheel.parent)
    (own,) = place.glob("lib/python*/site-packages")
    (own / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    try:
        told = ask(place / "bin" / "calibrator", "--version", cwd=place)
        case = own / "calibrator" / "cases" / "coarse_sand.toml"
        ask(place / "bin" / "calibrator", "plan", case, cwd=place)
    except RuntimeError as error:
        return [f"the wheel, installed: {error}"]
    return [] if told == version else [f"the wheel, installed, says it is {told}"]


def main(repo: Path = REPO) -> int:
    """Check, build, check; returns the exit status."""
    version = version_of(repo)
    wrong = contradictions(repo)
    if not wrong:
        shutil.rmtree(repo / "dist", ignore_errors=True)
        try:
            wheel, sdist = build(repo, repo / "dist", ["wheel", "sdist"])
            wrong = faults(sdist, wheel, version, repo)
        except RuntimeError as error:
            wrong = [str(error)]
    for line in wrong:
        print(f"release {version}: {line}", file=sys.stderr)
    if wrong:
        return 1
    for path in (wheel, sdist):
        print(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  dist/{path.name}")
    print(NEXT.format(version=version))
    return 0


if __name__ == "__main__":
    sys.exit(main())
