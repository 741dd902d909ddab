"""The command line: one verb per step, in workflow order, and `all` for the whole way."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from calibrator import __version__
from calibrator.case import read_case
from calibrator.errors import CalibratorError, one_line
from calibrator.runner import RETRIED, Progress

Outcome = dict[str, Any]


def main(arguments: list[str] | None = None) -> int:
    """Entry point. Returns the exit status: 0, 1 where a verification fails, 2 for bad input, 130 when interrupted."""
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
        print("\ncalibrator: interrupted; finished runs are kept, the same command goes on from them", file=sys.stderr)
        return 130


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


class _Parser(argparse.ArgumentParser):
    """argparse, with errors of one line."""

    def error(self, message: str) -> NoReturn:
        """End with status 2."""
        self.exit(2, f"{self.prog}: {one_line(message)}: see {self.prog} --help\n")


def _path(text: str) -> Path:
    """A path that is one. An empty argument, such as that of an unset variable of the shell, would be the present folder."""
    if not text or "\0" in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not a path")
    return Path(text)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="calibrator", description="Calibrate the particle parameters of a DEM model with YADE.")
    parser.add_argument("--version", action="version", version=__version__)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    whole = f"{', '.join(VERBS)}, one after the other"
    for verb, (about, _, _) in {**VERBS, "all": (whole, None, None), **DIAGNOSIS}.items():
        own = verbs.add_parser(verb, help=about, description=about)
        own.add_argument("case", type=_path, metavar="CASE", help="case file (TOML)")
        own.add_argument("--results", type=_path, default=Path("results"), help="where results go (default: ./results)")
        own.add_argument("--engine", choices=("local", "slurm"), default="local", help="where runs are made (default: local)")
        own.add_argument("--site", type=_path, help="TOML file with a [cluster] table (see docs/cluster.md)")
        own.add_argument("--fresh", action="store_true", help="ignore the shipped database: run everything here")
        own.add_argument("--verify-afresh", action="store_true", help="ignore shipped runs of verification and validation only")
        if verb in ("check", *DIAGNOSIS):
            own.add_argument("--lab", type=_path, metavar="FILE", help="lab file to take instead of the case's own")
        if verb in DIAGNOSIS:
            own.add_argument("--yes", action="store_true", help="spend more core-hours than diagnosis.budget_core_hours")
    return parser


def _do(options: argparse.Namespace) -> int:
    from calibrator.workspace import Workspace  # heavy imports only after the arguments are known to be good

    case = read_case(options.case, options.site, getattr(options, "lab", None))
    if options.verify_afresh:
        case = case.without_shipped_verification()
    space = Workspace(case, options.results / (case.name + ("_fresh" if options.fresh else "")), options.fresh, options.engine)
    if options.verb in DIAGNOSIS:
        _, load, describe = DIAGNOSIS[options.verb]
        outcome = load()(space, options.yes)
        _say(f"{options.verb}: {describe(outcome)}")
        if options.verb == "diagnose":
            from calibrator.diagnosis_page import write_diagnosis

            _say(f"  report: {write_diagnosis(space, outcome)}")
        return 0
    verbs = list(VERBS) if options.verb == "all" else [options.verb]
    good = True
    for verb in verbs:
        _, load, describe = VERBS[verb]
        outcome = load()(space)
        _say(f"{verb}: {describe(outcome)}")
        good = good and (verb != "verify" or outcome["passed"])  # a missed validation is a finding, not a failure
    if options.verb != "all" and verbs[0] != "report":
        _say(f"next: calibrator {list(VERBS)[list(VERBS).index(verbs[0]) + 1]} {options.case}")
    return 0 if good else 1


def _say(text: str) -> None:
    """Print what a terminal of any encoding can show: a path may hold bytes that are no text at all."""
    encoding = sys.stdout.encoding or "utf-8"
    print(text.encode(encoding, "backslashreplace").decode(encoding))


def _workflow(name: str, with_progress: bool = False) -> Callable[[], Callable[[Any], Outcome]]:
    def load() -> Callable[[Any], Outcome]:
        from calibrator import workflow

        verb = getattr(workflow, name)
        return (lambda space: _alone(verb, space)) if with_progress else verb

    return load


def _diagnosis(name: str) -> Callable[[], Callable[[Any, bool], Outcome]]:
    def load() -> Callable[[Any, bool], Outcome]:
        from calibrator import diagnosis, preflight

        verb = {"preflight": preflight.preflight, "diagnose": diagnosis.diagnose}[name]
        return lambda space, yes: _alone(verb, space, yes)

    return load


def _alone(verb: Callable[..., Outcome], space: Any, *more: Any) -> Outcome:
    """A verb that makes runs: one at a time in a results folder."""
    with space.runs.alone():
        return verb(space, ProgressBar(sys.stderr), *more)


def _report() -> Callable[[Any], Outcome]:
    from calibrator.report import write_report

    return write_report


class ProgressBar:
    """Runs done and failed, and time left: a line that rewrites itself on a terminal, a line a minute elsewhere."""

    def __init__(self, stream: Any) -> None:
        self.stream, self.last, self.over = stream, float("-inf"), False

    def __call__(self, progress: Progress) -> None:
        """Show one moment of a batch."""
        live, over = self.stream.isatty(), progress.done == progress.total
        since = time.monotonic() - self.last
        if (over and self.over) or (not over and since < (0.5 if live else 60)):
            return
        self.last, self.over = time.monotonic(), over
        filled = round(24 * progress.done / max(progress.total, 1))
        line = (
            f"[{'#' * filled}{'.' * (24 - filled)}] {progress.done}/{progress.total} runs, {progress.failed} failed, "
            f"{_minutes(progress.elapsed)} gone, {_minutes(progress.left)} left"
        )
        self.stream.write(f"\r{line}   " + ("\n" if over else "") if live else line + "\n")
        self.stream.flush()


def _minutes(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def _say_check(o: Outcome) -> str:
    return "\n".join([f"good; {o['runs']} runs, targets {', '.join(o['targets'])}", *(f"  warning: {w}" for w in o["warnings"])])


def _say_plan(o: Outcome) -> str:
    lines = [
        f"{o['runs']} runs, {o['finished']} finished; predicted {o['core_hours']:.2f} core-hours, {o['core_hours_left']:.2f} left"
    ]
    for name, s in o["setups"].items():
        lines.append(
            f"  {name}: {s['runs']} runs of {s['particles'][0]}-{s['particles'][1]} grains, "
            f"{s['steps'][0]:,}-{s['steps'][1]:,} steps, "
            f"{s['core_seconds_per_run'][0]:.0f}-{s['core_seconds_per_run'][1]:.0f} core-seconds"
        )
    return "\n".join(lines)


def _say_runs(o: Outcome) -> str:
    text = f"{o['runs']} runs: " + ", ".join(f"{n} {kind}" for kind, n in o["statuses"].items())
    if o.get("from_shipped_database"):
        text += f"; {o['from_shipped_database']} of them come with the project (same content), use --fresh to run them anew"
    if o.get("missing"):
        text += f"; {o['missing']} of the plan are still missing"
    lines = [text, *(f"  {run_id} {why}" for run_id, why in o["failed"].items())]
    if len(o["yade"]) > 1:
        lines.append(
            f"  made by YADE {', '.join(o['yade'])}: numbers of different versions may differ; --fresh makes all runs anew"
        )
    if any(why.startswith(RETRIED) for why in o["failed"].values()):
        lines.append("  failed runs are not tried again: for that, delete failures.json in the results folder")
    return "\n".join(lines)


def _say_calibrate(o: Outcome) -> str:
    best = o["candidates"]["compromise"]
    lines = [f"front of {o['front_size']}; compromise: {_values(best['parameters'])} ({o['compromise_reason']})"]
    lines += [f"  {sentence}" for sentence in o["reachability"]["sentences"]]
    for p in o["identifiability"]["parameters"]:
        truth = (
            "" if p["truth"] is None else f"; the truth is {p['truth']:.4g}, the compromise {best['parameters'][p['name']]:.4g}"
        )
        lines.append(f"  {p['sentence']}{truth}")
    return "\n".join(lines)


def _values(values: dict[str, float]) -> str:
    return ", ".join(f"{k} = {v:.4g}" for k, v in values.items())


def _say_verify(o: Outcome) -> str:
    lines = [f"{label}: {_say_verdict(v)}" for label, v in o["candidates"].items()]
    if not o["passed"]:
        lines.append(
            '  to go on: name a copy of database.csv as run.shipped and set plan.design = "adaptive" in the case; '
            "`calibrator run` then adds runs where they decide"
        )
    return "\n".join(lines)


def _say_validate(o: Outcome) -> str:
    return "\n".join([_say_verdict(o), *(f"{label}: {_say_verdict(v)}" for label, v in o["candidates"].items())])


def _say_verdict(o: Outcome) -> str:
    shipped = f" ({o['from_shipped_database']} of its runs come with the project)" if o.get("from_shipped_database") else ""
    lines = [f"{'passed' if o['passed'] else 'NOT passed'}, O1 = {o['o1']:.4f}{shipped}"]
    for r in o["responses"]:
        promise = "" if r["predicted"] is None else f", predicted {r['predicted']:.5g}"
        lines.append(
            f"  {r['key']}: target {r['target']:.5g}{promise}, simulated {r['simulated']:.5g} +- {r['standard_error']:.2g} "
            f"({r['relative_error']:+.1%}, band {r['band'] / abs(r['target']):.1%}): {'met' if r['passed'] else 'MISSED'}"
        )
    return "\n".join([*lines, *(f"  {run_id} {why}" for run_id, why in o["failed"].items())])


def _say_preflight(o: Outcome) -> str:
    lines = [f"{len(o['observables'])} observables, {o['degrees']} degrees of freedom"]
    for e in o["effects"]:
        sizes = [
            f"{words} from {_size(e[key])}" for words, key in (("seen", "smallest_detectable"), ("named", "smallest_nameable"))
        ]
        unit = "" if e["unit"] == "1" else f" [{e['unit']}]"
        alias = f", most like {e['alias']} ({e['alias_cosine']:.2f})" if e["alias"] else ""
        lines.append(
            f"  {e['called']} ({e['effect']}{unit}, plausible {e['scale']:g}): {', '.join(sizes)}; "
            f"recalibration hides {e['absorbed']:.0%}{alias}"
        )
    for hidden, said in o["self_test"].items():
        lines.append(
            f"  imagined {hidden}: " + ", ".join(f"{n} x {what}" for what, n in sorted(said.items(), key=lambda x: -x[1]))
        )
    if o["further_experiments"]:
        best = max(o["further_experiments"], key=o["further_experiments"].__getitem__)
        factor = 2.718281828 ** -o["further_experiments"][best]
        lines.append(f"  of the experiments not measured yet, {best} helps most: nameable sizes fall to {factor:.0%} on average")
    return "\n".join([*lines, *(f"  note: {n}" for n in o["notes"])])


def _size(value: float | None) -> str:
    return "no size" if value is None else f"{value:.2g}"


def _say_diagnose(o: Outcome) -> str:
    text = o["sentence"] + (f"\n  next: calibrator run {o['new_case']}" if o.get("new_case") else "")
    return "\n".join([text, *(f"  note: {n}" for n in o.get("notes", []))])


def _say_report(o: Outcome) -> str:
    return f"{o['page']}"


VERBS: dict[str, tuple[str, Any, Any]] = {
    "check": ("find everything wrong with a case before a run is made", _workflow("check_case"), _say_check),
    "plan": ("write the yade-batch tables and predict the cost", _workflow("plan"), _say_plan),
    "run": ("carry out the plan on YADE; resumes", _workflow("run_plan", True), _say_runs),
    "collect": ("gather finished runs into the response database", _workflow("collect"), _say_runs),
    "calibrate": ("interpolate, search the Pareto front, choose candidates", _workflow("calibrate"), _say_calibrate),
    "verify": ("run YADE afresh at the candidates", _workflow("verify", True), _say_verify),
    "validate": ("predict measurements that were not used, on other set-ups", _workflow("validate", True), _say_validate),
    "report": ("write one self-contained page with figures and tables", _report, _say_report),
}

DIAGNOSIS: dict[str, tuple[str, Any, Any]] = {
    "preflight": (
        "what these observables could say about a missing effect, and which further experiment would help",
        _diagnosis("preflight"),
        _say_preflight,
    ),
    "diagnose": ("find the gap, name the missing effect, show the gap shrink", _diagnosis("diagnose"), _say_diagnose),
}

if __name__ == "__main__":
    sys.exit(main())
