"""The verb `doctor`: what this machine has of what runs need, and what is missing."""

from __future__ import annotations

import os
import platform
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from calibrator import __version__
from calibrator.case.vocabulary import SCRIPTS
from calibrator.errors import CalibratorError, one_line
from calibrator.files import parse_json
from calibrator.runs.local import clean_environment
from calibrator.runs.programs import AROUND, Build, chosen, installing, namespace, said_by

TRIED = ("2023.02a", "2025.2.0")
"""Versions of YADE that the tests on real runs have passed on."""

PATIENCE = 120.0  # seconds for YADE to start, which it does in one
LITTLE = 200e6  # bytes; a run of ten thousand grains leaves about one megabyte
MARK = "calibrator asks: "

# What YADE runs when it is asked what it is: session.py has all names that the scripts take of it.
QUESTION = f"""\
import json, sys
from yade import config
sys.path.insert(0, {str(SCRIPTS)!r})
try:
    import numpy, session
    trouble = ""
except Exception as error:
    trouble = "%s: %s" % (type(error).__name__, error)
answer = [config.version, sys.version.split()[0], sorted(set(config.features)), trouble]
print("\\n" + {MARK!r} + json.dumps(answer))
"""


@dataclass(frozen=True)
class Missing:
    """Something that this machine lacks: what, why it is needed, and what to do.

    essential : whether no run can be made without it.
    """

    what: str
    why: str
    remedy: str
    essential: bool = True

    def line(self) -> str:
        """The lack in plain words."""
        return f"{self.what}: {self.why}: {self.remedy}"


@dataclass(frozen=True)
class Yade:
    """What a build of YADE says of itself.

    program, batch : paths, empty where there is none; version, python : of it; features : that it
    was compiled with; trouble : why it cannot run the scripts, empty where it can.
    """

    program: str
    batch: str
    version: str = ""
    python: str = ""
    features: tuple[str, ...] = ()
    trouble: str = ""


@dataclass(frozen=True)
class Machine:
    """Outcome of the verb `doctor`.

    calibrator, python : versions; system : the distribution; yade : the build that would be used;
    cores : that this process may use; memory [bytes] : that is free, None where that is not known;
    network_namespace : whether runs can be cut off from the network; slurm : version, empty where
    none answers; results : folder of the results; free_space [bytes] : on its disk; missing : what
    the engine that was asked for lacks.
    """

    calibrator: str
    python: str
    system: str
    engine: str
    yade: Yade
    cores: int
    memory: int | None
    network_namespace: bool
    slurm: str
    results: str
    free_space: int
    missing: tuple[Missing, ...]

    DERIVED = ("good",)

    @property
    def good(self) -> bool:
        """Whether runs can be made."""
        return not any(one.essential for one in self.missing)

    def warnings(self) -> list[str]:
        """What runs can do without.

        Raises CalibratorError, with the remedy, where they lack what they cannot do without.
        """
        for one in self.missing:
            if one.essential:
                raise CalibratorError(one.line())
        return [one.line() for one in self.missing]

    def lines(self) -> list[str]:
        """The outcome in plain words."""
        words = "runs can be made here" if self.good else "no run can be made here"
        yade, memory = self.yade, self.memory
        version = f" {yade.version} ({yade.program}, Python {yade.python})" if yade.version else ""
        return [
            words,
            f"  calibrator {self.calibrator}, Python {self.python}, {self.system}",
            f"  YADE:{version or ' none that answers'}",
            f"    yade-batch: {yade.batch or 'none'}",
            f"    features: {' '.join(yade.features) or 'not known'}",
            f"  cores: {self.cores}",
            f"  free memory: {'not known' if memory is None else f'{memory / 1e9:.1f} GB'}",
            f"  network namespace: {'yes' if self.network_namespace else 'no'}",
            f"  SLURM: {self.slurm or 'none'}",
            f"  results: {self.results}, {self.free_space / 1e9:.1f} GB free",
            *(
                f"  {'missing' if one.essential else 'warning'}: {one_line(one.line())}"
                for one in self.missing
            ),
        ]


def examine(results: Path, engine: str = "local", named: str = "") -> Machine:
    """Look at this machine: programs, YADE, cores, memory, network, disk.

    Parameters
    ----------
    results : folder of the results, which need not exist.
    engine : "local" or "slurm": what is essential depends on it.
    named : the YADE that a case names under [run].
    """
    build, wall = chosen(named), namespace()
    yade = _ask(build, wall)
    below = next((p for p in (results, *results.absolute().parents) if p.is_dir()), Path("/"))
    free = shutil.disk_usage(below).free
    missing = [*_lacks_of_disk(below, free)]
    slurm, silence = _slurm()
    missing += (
        _lacks_of_slurm(silence) if engine == "slurm" else _lacks_of_programs(build, yade, wall)
    )
    if yade.version and yade.version not in TRIED:
        why = f"only {', '.join(TRIED)} were tried"
        remedy = "compare a run or two with theirs (python -m benchmarks.runs.versions)"
        missing.append(Missing(f"YADE {yade.version} is new here", why, remedy, False))
    return Machine(
        calibrator=__version__,
        python=platform.python_version(),
        system=_system(),
        engine=engine,
        yade=yade,
        cores=len(os.sched_getaffinity(0)),
        memory=_free_memory(),
        network_namespace=bool(wall),
        slurm=slurm,
        results=str(results),
        free_space=free,
        missing=tuple(missing),
    )


def _ask(build: Build, wall: list[str]) -> Yade:
    """What a build says of itself when it is started behind a wall (see `namespace`)."""
    program, batch = (shutil.which(name) or "" for name in (build.yade, build.batch))
    if not program:
        return Yade(program, batch)
    with tempfile.TemporaryDirectory(prefix="calibrator-") as scratch:
        question = Path(scratch) / "question.py"
        question.write_text(QUESTION)
        command = [*wall, program, "-n", "-x", "-j1", str(question)]
        status, said = said_by(command, clean_environment(PATIENCE, PATIENCE), PATIENCE)
    answer = [line.removeprefix(MARK) for line in said.splitlines() if line.startswith(MARK)]
    try:
        version, python, features, trouble = parse_json(answer[-1])
        return Yade(
            program,
            batch,
            str(version),
            str(python),
            tuple(map(str, features)),
            one_line(str(trouble)),
        )
    except (IndexError, ValueError, TypeError):
        last = (said.strip() or f"status {status} and no word").splitlines()[-1]
        return Yade(program, batch, trouble=one_line(f"it does not start: {last}"))


def _lacks_of_programs(build: Build, yade: Yade, wall: list[str]) -> list[Missing]:
    """What runs on this machine lack of programs."""
    found = []
    for name, path in ((build.yade, yade.program), (build.batch, yade.batch)):
        if not path:
            found.append(Missing(f"{name} is not installed", "it makes the runs", build.remedy()))
    if yade.trouble:
        remedy = f"take another build (see docs/case_file.md), or {installing('yade')}"
        found.append(Missing(f"{yade.program} cannot be used", yade.trouble, remedy))
    for name, package in AROUND.items():
        if shutil.which(name) is None:
            why = "each run is wrapped into it"
            found.append(Missing(f"{name} is not installed", why, installing(package)))
    if not wall:
        why = "YADE's servers can be reached from other machines while runs are made"
        remedy = (
            "close ports 9000 and above, or allow unprivileged user namespaces"
            if shutil.which("unshare")
            else installing("util-linux")
        )
        found.append(Missing("there is no network namespace", why, remedy, False))
    return found


def _lacks_of_slurm(silence: str) -> list[Missing]:
    """What submitting to a cluster lacks; YADE is needed on its nodes, not here."""
    remedy = "call this on a login node, or leave out --engine slurm"
    found = [
        Missing(f"{name} is not installed", "it hands runs to the cluster", remedy)
        for name in ("sbatch", "squeue")
        if shutil.which(name) is None
    ]
    return found or ([Missing("SLURM does not answer", silence, remedy)] if silence else [])


def _lacks_of_disk(folder: Path, free: int) -> list[Missing]:
    """What is wrong with the disk that results go to."""
    try:
        with tempfile.TemporaryDirectory(prefix=".calibrator-", dir=folder) as scratch:
            (Path(scratch) / "link").symlink_to(folder, target_is_directory=True)
    except OSError as error:
        why = f"files and symbolic links cannot be made ({error.strerror or error})"
        return [Missing(f"{folder} does not take results", why, "give another with --results")]
    if free < LITTLE:
        why = f"{free / 1e6:.0f} MB are free"
        return [Missing("there is little room", why, "free some, or give --results", False)]
    return []


def _system() -> str:
    """The distribution, as it calls itself."""
    try:
        return platform.freedesktop_os_release().get("PRETTY_NAME", sys.platform)
    except OSError:
        return platform.platform()


def _free_memory() -> int | None:
    """Memory [bytes] that can be taken without swapping; None where the kernel does not say."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        (kilobytes,) = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    except (OSError, ValueError, IndexError):
        return None
    return int(kilobytes) * 1024


def _slurm() -> tuple[str, str]:
    """Version of SLURM, empty where there is none, and why it does not answer where there is."""
    if shutil.which("sbatch") is None:
        return "", ""
    status, said = said_by(["sbatch", "--version"], dict(os.environ), 20)
    last = one_line((said.strip() or "no word").splitlines()[-1])
    return (last, "") if status == 0 else ("", last)
