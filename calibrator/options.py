"""The command line's verbs and options."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NoReturn

import shtab

from calibrator import __version__
from calibrator.errors import one_line
from calibrator.handover.names import ENGINES
from calibrator.laboratory.verb import add_arguments
from calibrator.verbs import DIAGNOSIS, HANDED_ON, INIT, LOOKED_AT, MEASURE, VERBS, Verb
from calibrator.view.names import FRAMES

MAKE_RUNS = (
    "all",
    "demo",
    *(n for n, v in {**VERBS, **DIAGNOSIS}.items() if v.makes_runs),
)


class Parser(argparse.ArgumentParser):
    """argparse, with errors of one line."""

    def error(self, message: str) -> NoReturn:
        """End with status 2."""
        self.exit(2, f"{self.prog}: {one_line(message)}: see {self.prog} --help\n")


def _path(text: str) -> Path:
    """A path that is one.

    An empty argument, such as that of an unset variable of the shell, would be the present folder.
    """
    if not text or "\0" in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not a path")
    return Path(text)


def parser() -> argparse.ArgumentParser:
    """The parser of the command line, a subcommand for each verb."""
    whole_line = Parser(
        prog="calibrator", description="Calibrate the particle parameters of a DEM model with YADE."
    )
    whole_line.add_argument("--version", action="version", version=__version__)
    shtab.add_argument_to(whole_line, help="print what a shell needs to complete commands, and end")
    verbs = whole_line.add_subparsers(dest="verb", required=True, metavar="VERB")
    whole = Verb(f"{', '.join(VERBS)}, one after the other", "")
    demo = Verb("copy the demo's sand into the present folder, and do `all` on it", "")
    doctor = Verb("say what this machine has of what runs need, and what is missing", "")
    both = {"doctor": doctor, "demo": demo}
    of_a_case = {**VERBS, "all": whole, **DIAGNOSIS, **LOOKED_AT, **HANDED_ON}
    for name, verb in {**both, **of_a_case}.items():
        own = verbs.add_parser(name, help=verb.about, description=verb.about)
        _add_options(own, name)
    add_arguments(verbs.add_parser("measure", help=MEASURE, description=MEASURE), _path)
    _add_init(verbs.add_parser("init", help=INIT, description=INIT))
    _complete_files(whole_line)
    return whole_line


def _complete_files(own: argparse.ArgumentParser) -> None:
    """Let a shell complete names of files where an argument is a path, in all subcommands too."""
    for action in own._actions:
        if action.type is _path:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                _complete_files(below)


def _add_init(own: argparse.ArgumentParser) -> None:
    """Add the options of the verb that makes a case."""
    own.add_argument("--answers", type=_path, metavar="FILE", help="TOML file (see docs/init.md)")
    own.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="an answer, such as grain_diameter='2 mm'; wins over the file; may be repeated",
    )
    own.add_argument("--out", type=_path, default=Path(), metavar="DIR", help="(default: here)")
    own.add_argument("--json", action="store_true", help="print the outcome as JSON")


def _add_options(own: argparse.ArgumentParser, verb: str) -> None:
    """Add the options that a verb takes."""
    if verb != "demo":
        number = "?" if verb == "doctor" else None
        own.add_argument("case", type=_path, metavar="CASE", help="case file (TOML)", nargs=number)
    own.add_argument(
        "--results",
        type=_path,
        default=Path("results"),
        help="where results go (default: ./results)",
    )
    own.add_argument(
        "--engine",
        choices=("local", "slurm"),
        default="local",
        help="where runs are made (default: local)",
    )
    own.add_argument(
        "--site", type=_path, help="TOML file with a [cluster] table (see docs/cluster.md)"
    )
    own.add_argument(
        "--json", action="store_true", help="print the outcome as JSON instead of words"
    )
    if verb == "doctor":
        return
    _add_runs(own)
    if verb in MAKE_RUNS:
        own.add_argument(
            "--dry-run",
            action="store_true",
            help="say how many runs would be made and what they cost, and end there",
        )
    if verb in ("check", *DIAGNOSIS):
        own.add_argument(
            "--lab", type=_path, metavar="FILE", help="lab file to take instead of the case's own"
        )
    if verb in DIAGNOSIS:
        own.add_argument(
            "--yes",
            action="store_true",
            help="spend more core-hours than diagnosis.budget_core_hours",
        )
    if verb in HANDED_ON:
        _add_handing_on(own, verb)
    if verb in LOOKED_AT:
        _add_looking_at(own)


def _add_runs(own: argparse.ArgumentParser) -> None:
    """Add the options that say which runs are taken, and made."""
    own.add_argument(
        "--fresh", action="store_true", help="ignore the shipped database: run everything here"
    )
    own.add_argument(
        "--verify-afresh",
        action="store_true",
        help="ignore shipped runs of verification and validation only",
    )
    own.add_argument(
        "--go-on",
        action="store_true",
        help="make all runs, although the first ones failed alike",
    )


def _add_handing_on(own: argparse.ArgumentParser, verb: str) -> None:
    """Add the options of a verb that hands a calibration on."""
    which = "a member of the front, such as B (default: the compromise)"
    own.add_argument("--candidate", metavar="NAME", default="", help=which)
    own.add_argument("--out", type=_path, metavar="DIR", help="folder of the files")
    if verb == "export":
        which = "engine (default: all)"
        own.add_argument("--to", choices=(*ENGINES, "all"), default="all", help=which)


def _add_looking_at(own: argparse.ArgumentParser) -> None:
    """Add what the verb takes that looks into a run."""
    which = "run id or its beginning, or a member of the front, such as B (default: the compromise)"
    own.add_argument("run", metavar="RUN", nargs="?", default="", help=which)
    which = "experiment of a candidate's run, such as ledge (default: the case's first)"
    own.add_argument("--setup", metavar="NAME", default="", help=which)
    which = "most frames of the animation"
    own.add_argument("--frames", metavar="N", type=int, default=FRAMES, help=which)
    own.add_argument(
        "--anyway", action="store_true", help="show the run also where it is not the noted one"
    )
