"""The command line: one verb per step, in workflow order, and `all` for the whole way."""

from __future__ import annotations

import argparse
import errno
import logging
import shlex
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibrator.case.toml import read_case
from calibrator.demo import lay_out
from calibrator.errors import CalibratorError, DryRun, one_line
from calibrator.laboratory.verb import measure
from calibrator.options import parser
from calibrator.terminal import say, say_json
from calibrator.verbs import DIAGNOSIS, HANDED_ON, LOOKED_AT, VERBS

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
    options = parser().parse_args(arguments)
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        if options.verb == "measure":
            return _measure(options, sys.argv[1:] if arguments is None else arguments)
        if options.verb == "init":
            return _init(options)
        return _do(options)
    except DryRun as rest:
        if options.json:
            say_json(rest)
        else:
            say("dry run: " + "\n".join(rest.lines()))
        return 0
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
        case,
        folder,
        options.fresh,
        options.engine,
        _given(options),
        options.go_on,
        dry_run=getattr(options, "dry_run", False),
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


def _init(options: argparse.Namespace) -> int:
    """Make a case of answers, or of questions where none are given."""
    from calibrator.first_case.answers import answers_of, read_answers, with_options
    from calibrator.first_case.questions import ask_all
    from calibrator.first_case.verb import init

    if options.answers is None and not options.set:
        if not sys.stdin.isatty():
            raise CalibratorError(
                "no terminal to ask on: give --answers FILE, or --set KEY=VALUE (docs/init.md)"
            )
        table = ask_all(input, say)
    else:
        table = with_options(read_answers(options.answers) if options.answers else {}, options.set)
    answers = answers_of(table, options.answers.parent if options.answers else Path())
    begun = init(answers, options.out, _timed)
    if options.json:
        say_json(begun)
    else:
        say("init: " + "\n".join(begun.lines()))
        say(f"next: {shlex.join(['calibrator', 'check', begun.case])}")
    return 0


def _timed() -> float | None:
    """How fast this machine is; None where no run can be made here."""
    from calibrator.runs.speed import measured_rate

    print("init: timing a short run of YADE, to know what runs cost here", file=sys.stderr)
    return measured_rate()


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
