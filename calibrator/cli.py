"""The command line: one verb per step, in workflow order, and `all` for the whole way."""

from __future__ import annotations

import argparse
import errno
import logging
import shlex
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from calibrator import __version__
from calibrator.case.toml import read_case
from calibrator.demo import lay_out
from calibrator.errors import CalibratorError, one_line
from calibrator.handover.names import ENGINES
from calibrator.laboratory.verb import add_arguments, measure
from calibrator.terminal import say, say_json
from calibrator.verbs import DIAGNOSIS, HANDED_ON, LOOKED_AT, MEASURE, VERBS, Verb
from calibrator.view.names import FRAMES

if TYPE_CHECKING:
    from calibrator.runs.workspace import Workspace


REMEDIES = {
    errno.ENOSPC: "free space",
    errno.EDQUOT: "free space",
    errno.EACCES: "mend the permissions",
    errno.EPERM: "mend the permissions, or give a place on another drive with --results",
    errno.EROFS: "the drive is read-only, give a place on another one with --results",
}
"""What to do about an error of the operating system, by its number."""


def main(arguments: list[str] | None = None) -> int:
    """Entry point.

    Returns the exit status: 0, 1 where a verification fails, no run of the plan was good or none
    can be made here, 2 for bad input or a plan given up, 130 when interrupted.
    """
    options = _parser().parse_args(arguments)
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        if options.verb == "measure":
            return _measure(options, sys.argv[1:] if arguments is None else arguments)
        return _do(options)
    except CalibratorError as error:
        print(f"calibrator: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 0
    except OSError as error:
        remedy = REMEDIES.get(error.errno or 0, "see to that place, or give another with --results")
        print(
            f"calibrator: {one_line(str(error))}: {remedy}, then run the same command again",
            file=sys.stderr,
        )
        return 2
    except KeyboardInterrupt:
        print(
            "\ncalibrator: interrupted; finished runs are kept, the same command goes on from them",
            file=sys.stderr,
        )
        return 130


def _interrupt(*_: Any) -> None:
    """End as Ctrl-C does: finished runs are kept."""
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
    """The parser of the command line, a subcommand for each verb."""
    parser = _Parser(
        prog="calibrator", description="Calibrate the particle parameters of a DEM model with YADE."
    )
    parser.add_argument("--version", action="version", version=__version__)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    whole = Verb(f"{', '.join(VERBS)}, one after the other", "")
    demo = Verb("copy the demo's sand into the present folder, and do `all` on it", "")
    doctor = Verb("say what this machine has of what runs need, and what is missing", "")
    both = {"doctor": doctor, "demo": demo}
    of_a_case = {**VERBS, "all": whole, **DIAGNOSIS, **LOOKED_AT, **HANDED_ON}
    for name, verb in {**both, **of_a_case}.items():
        own = verbs.add_parser(name, help=verb.about, description=verb.about)
        _add_options(own, name)
        if name in LOOKED_AT:
            _add_looking_at(own)
    add_arguments(verbs.add_parser("measure", help=MEASURE, description=MEASURE), _path)
    return parser


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


def _given(options: argparse.Namespace) -> tuple[str, ...]:
    """The options that another verb on the same results needs as well."""
    given = []
    if options.results != Path("results"):
        given += ["--results", str(options.results)]
    if options.engine != "local":
        given += ["--engine", options.engine]
    if options.site is not None:
        given += ["--site", str(options.site)]
    flags = {"--fresh": options.fresh, "--verify-afresh": options.verify_afresh}
    return (*given, *(flag for flag, on in flags.items() if on))


def _workspace(options: argparse.Namespace) -> Workspace:
    """The case that was named, and the folder of its results."""
    # heavy imports only after the arguments are known to be good
    from calibrator.runs.workspace import Workspace

    case = read_case(options.case, options.site, getattr(options, "lab", None))
    if options.verify_afresh:
        case = case.without_shipped_verification()
    folder = options.results / (case.name + ("_fresh" if options.fresh else ""))
    return Workspace(
        case, folder, options.fresh, options.engine, _given(options), go_on=options.go_on
    )


def _doctor(options: argparse.Namespace) -> int:
    """Look at this machine; returns 1 where no run can be made on it."""
    from calibrator.runs.machine import examine

    named = read_case(options.case, options.site).run.yade if options.case else ""
    found = examine(options.results, options.engine, named)
    _say(options, found)
    return 0 if found.good else 1


def _measure(options: argparse.Namespace, arguments: list[str]) -> int:
    """Measure raw data."""
    _say(options, measure(options, arguments))
    return 0


def _say(options: argparse.Namespace, outcome: Any) -> None:
    """Print the outcome of the verb, in words or as JSON."""
    if options.json:
        say_json(outcome)
    else:
        say(f"{options.verb}: " + "\n".join(outcome.lines()))


def _lay_out_demo(options: argparse.Namespace) -> None:
    """Copy the demo's files, say so, and let the options ask for the whole way on its case."""
    options.case, written = lay_out(Path())
    options.verb = "all"
    if not options.json:
        say("demo: " + (f"wrote {', '.join(written)}" if written else "its files are here already"))
        say(f"  what follows is the verb all on {options.case}; a sand of your own starts from it")


def _do(options: argparse.Namespace) -> int:
    """Carry out what was asked for; returns the exit status."""
    if options.verb == "doctor":
        return _doctor(options)
    if options.verb == "demo":
        _lay_out_demo(options)
    space = _workspace(options)
    if options.verb in DIAGNOSIS:
        return _diagnose(options, space)
    if options.verb in HANDED_ON:
        return _hand_on(options, space)
    if options.verb in LOOKED_AT:
        return _look_at(options, space)
    verbs = list(VERBS) if options.verb == "all" else [options.verb]
    outcomes, good = {}, True
    for verb in verbs:
        outcomes[verb] = outcome = VERBS[verb](space)
        if not options.json:
            say(f"{verb}: " + "\n".join(outcome.lines()))
        # a missed validation is a finding, not a failure
        good = good and (verb not in ("run", "verify") or outcome.passed)
    if options.json:
        say_json(outcomes if options.verb == "all" else outcomes[options.verb])
    elif options.verb != "all" and verbs[0] != "report":
        after = list(VERBS)[list(VERBS).index(verbs[0]) + 1]
        # a calibration reads the case's own lab file; a pre-flight takes another one, too
        if lab := getattr(options, "lab", None):
            say(f"next: {space.command('preflight')} {shlex.join(['--lab', str(lab)])}")
        else:
            say(f"next: {space.command(after)}")
    return 0 if good else 1


def _hand_on(options: argparse.Namespace, space: Workspace) -> int:
    """Write what others need of a calibration; returns the exit status."""
    more = [options.to] if options.verb == "export" else []
    _say(options, HANDED_ON[options.verb](space, options.candidate, *more, options.out))
    return 0


def _look_at(options: argparse.Namespace, space: Workspace) -> int:
    """Look into a run; returns the exit status."""
    outcome = LOOKED_AT["view"](space, options.run, options.setup, options.frames, options.anyway)
    _say(options, outcome)
    return 0


def _diagnose(options: argparse.Namespace, space: Workspace) -> int:
    """Carry out a verb of the diagnosis; returns the exit status."""
    outcome = DIAGNOSIS[options.verb](space, options.yes)
    _say(options, outcome)
    if options.verb == "diagnose":
        from calibrator.report.diagnosis import write_diagnosis

        page = write_diagnosis(space, outcome)
        if not options.json:
            say(f"  report: {page}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
