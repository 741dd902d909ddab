"""The command line: one verb per step, in workflow order, and `all` for the whole way."""

from __future__ import annotations

import argparse
import importlib
import logging
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from calibrator import __version__
from calibrator.case.toml import read_case
from calibrator.errors import CalibratorError, one_line
from calibrator.terminal import (
    Outcome,
    ProgressBar,
    say,
    say_calibrate,
    say_check,
    say_diagnose,
    say_plan,
    say_preflight,
    say_report,
    say_runs,
    say_validate,
    say_verify,
)


def main(arguments: list[str] | None = None) -> int:
    """Entry point.

    Returns the exit status: 0, 1 where a verification fails, 2 for bad input, 130 when interrupted.
    """
    options = _parser().parse_args(arguments)
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        return _do(options)
    except CalibratorError as error:
        print(f"calibrator: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 0
    except OSError as error:
        remedy = "free space or mend the permissions, then run the same command again"
        print(f"calibrator: {one_line(str(error))}: {remedy}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(
            "\ncalibrator: interrupted; finished runs are kept, the same command goes on from them",
            file=sys.stderr,
        )
        return 130


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


class _Parser(argparse.ArgumentParser):
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


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="calibrator", description="Calibrate the particle parameters of a DEM model with YADE."
    )
    parser.add_argument("--version", action="version", version=__version__)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    whole = f"{', '.join(VERBS)}, one after the other"
    for verb, (about, _, _) in {**VERBS, "all": (whole, None, None), **DIAGNOSIS}.items():
        own = verbs.add_parser(verb, help=about, description=about)
        own.add_argument("case", type=_path, metavar="CASE", help="case file (TOML)")
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
            "--fresh", action="store_true", help="ignore the shipped database: run everything here"
        )
        own.add_argument(
            "--verify-afresh",
            action="store_true",
            help="ignore shipped runs of verification and validation only",
        )
        if verb in ("check", *DIAGNOSIS):
            own.add_argument(
                "--lab",
                type=_path,
                metavar="FILE",
                help="lab file to take instead of the case's own",
            )
        if verb in DIAGNOSIS:
            own.add_argument(
                "--yes",
                action="store_true",
                help="spend more core-hours than diagnosis.budget_core_hours",
            )
    return parser


def _do(options: argparse.Namespace) -> int:
    # heavy imports only after the arguments are known to be good
    from calibrator.runs.workspace import Workspace

    case = read_case(options.case, options.site, getattr(options, "lab", None))
    if options.verify_afresh:
        case = case.without_shipped_verification()
    space = Workspace(
        case,
        options.results / (case.name + ("_fresh" if options.fresh else "")),
        options.fresh,
        options.engine,
    )
    if options.verb in DIAGNOSIS:
        _, load, describe = DIAGNOSIS[options.verb]
        outcome = load()(space, options.yes)
        say(f"{options.verb}: {describe(outcome)}")
        if options.verb == "diagnose":
            from calibrator.report.diagnosis import write_diagnosis

            say(f"  report: {write_diagnosis(space, outcome)}")
        return 0
    verbs = list(VERBS) if options.verb == "all" else [options.verb]
    good = True
    for verb in verbs:
        _, load, describe = VERBS[verb]
        outcome = load()(space)
        say(f"{verb}: {describe(outcome)}")
        # a missed validation is a finding, not a failure
        good = good and (verb != "verify" or outcome["passed"])
    if options.verb != "all" and verbs[0] != "report":
        say(f"next: calibrator {list(VERBS)[list(VERBS).index(verbs[0]) + 1]} {options.case}")
    return 0 if good else 1


def _loaded(where: str, with_progress: bool = False) -> Callable[[], Callable[..., Outcome]]:
    """Loader of the verb at "module:function": heavy imports only once the verb is called."""

    def load() -> Callable[..., Outcome]:
        module, _, name = where.partition(":")
        verb = getattr(importlib.import_module(f"calibrator.{module}"), name)
        return (lambda space, *more: _alone(verb, space, *more)) if with_progress else verb

    return load


def _alone(verb: Callable[..., Outcome], space: Any, *more: Any) -> Outcome:
    """A verb that makes runs: one at a time in a results folder."""
    with space.runs.alone():
        return verb(space, ProgressBar(sys.stderr), *more)


VERBS: dict[str, tuple[str, Any, Any]] = {
    "check": (
        "find everything wrong with a case before a run is made",
        _loaded("check:check_case"),
        say_check,
    ),
    "plan": (
        "write the yade-batch tables and predict the cost",
        _loaded("plan.forecast:plan"),
        say_plan,
    ),
    "run": ("carry out the plan on YADE; resumes", _loaded("plan.run:run_plan", True), say_runs),
    "collect": (
        "gather finished runs into the response database",
        _loaded("plan.run:collect"),
        say_runs,
    ),
    "calibrate": (
        "interpolate, search the Pareto front, choose candidates",
        _loaded("search.calibrate:calibrate"),
        say_calibrate,
    ),
    "verify": (
        "run YADE afresh at the candidates",
        _loaded("verification.verify:verify", True),
        say_verify,
    ),
    "validate": (
        "predict measurements that were not used, on other set-ups",
        _loaded("verification.verify:validate", True),
        say_validate,
    ),
    "report": (
        "write one self-contained page with figures and tables",
        _loaded("report.page:write_report"),
        say_report,
    ),
}

DIAGNOSIS: dict[str, tuple[str, Any, Any]] = {
    "preflight": (
        (
            "what these observables could say about a missing effect, and which further experiment"
            " would help"
        ),
        _loaded("diagnosis.preflight:preflight", True),
        say_preflight,
    ),
    "diagnose": (
        "find the gap, name the missing effect, show the gap shrink",
        _loaded("diagnosis.diagnose:diagnose", True),
        say_diagnose,
    ),
}


if __name__ == "__main__":
    sys.exit(main())
