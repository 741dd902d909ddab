"""`make release` refuses what contradicts itself, and builds what can be installed."""

import subprocess
from pathlib import Path

import pytest

from delivery import release

REPO = Path(__file__).resolve().parent.parent
LOG = "# Changelog\n\n## Unreleased\n\n## 7.8.9 (2026-01-31)\n\n### Added\n- A sand.\n"


def git(repo, *words):
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    subprocess.run(["git", *who, *words], cwd=repo, check=True, capture_output=True)


@pytest.fixture(scope="module")
def ready(tmp_path_factory):
    """A clone of this checkout, work tree and all, that is ready for its release 7.8.9."""
    repo = tmp_path_factory.mktemp("release") / "project"
    kept = "git ls-files -z --cached --others --exclude-standard | xargs -0 cp --parents -t"
    repo.mkdir()
    subprocess.run(["bash", "-c", f'{kept} "$0"', repo], cwd=REPO, check=True)
    for name, old, new in (
        ("calibrator/__init__.py", '__version__ = "', '__version__ = "7.8.9"  # "'),
        ("CITATION.cff", "\nversion: ", "\nversion: 7.8.9\nformer: "),
    ):
        text = (repo / name).read_text()
        assert old in text
        (repo / name).write_text(text.replace(old, new))
    (repo / "CHANGELOG.md").write_text(LOG)
    git(repo, "init", "-q")
    git(repo, "add", "-A")
    git(repo, "commit", "-qm", "all")
    return repo


@pytest.fixture
def repo(ready):
    yield ready
    git(ready, "checkout", "-q", ".")
    git(ready, "clean", "-qfd")


@pytest.mark.slow
def test_a_release_that_is_ready_is_built_and_checked_and_nothing_else_changes(repo, capsys):
    assert release.main(repo) == 0, capsys.readouterr().err
    said = capsys.readouterr().out
    names = {path.name for path in (repo / "dist").iterdir()}
    assert names == {"dem_calibrator-7.8.9-py3-none-any.whl", "dem_calibrator-7.8.9.tar.gz"}
    assert all(name in said for name in names) and "v7.8.9" in said
    assert release.contradictions(repo) == []
    assert not release.ask("git", "tag", cwd=repo)


@pytest.mark.parametrize(
    ("name", "old", "new", "why"),
    [
        ("calibrator/__init__.py", '"7.8.9"', '"7.8"', "is none such as"),
        ("CITATION.cff", "7.8.9", "7.8.8", "CITATION.cff does not say"),
        ("CHANGELOG.md", "released\n", "released\n- More.\n", "belongs under"),
        ("CHANGELOG.md", "(2026-01-31)", "(not published)", "has nothing under"),
        ("CHANGELOG.md", "\n### Added\n- A sand.\n", "", "has nothing under"),
        ("README.md", "sand", "gravel", "not committed"),
    ],
)
def test_a_release_that_contradicts_itself_is_refused(repo, capsys, name, old, new, why):
    text = (repo / name).read_text()
    assert old in text
    (repo / name).write_text(text.replace(old, new))
    assert release.main(repo) == 1
    assert why in capsys.readouterr().err


def test_a_version_that_is_the_tag_of_another_commit_is_refused(repo):
    git(repo, "tag", "v7.8.9")
    assert release.contradictions(repo) == []
    git(repo, "commit", "-q", "--allow-empty", "-m", "more")
    try:
        assert any("tag of another commit" in why for why in release.contradictions(repo))
    finally:
        git(repo, "tag", "-d", "v7.8.9")


def test_nothing_is_uploaded():
    text = (REPO / "delivery" / "release.py").read_text()
    assert "upload" not in text.replace(release.NEXT, "").replace("uploads nothing", "")
