"""What the verbs print, and the progress bar."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

from calibrator.runs.batch import Progress
from calibrator.runs.folder import RETRIED

if TYPE_CHECKING:  # or asking for help would wait for scipy
    from calibrator.diagnosis.outcome import Diagnosis, Preflight

Outcome = dict[str, Any]


def say(text: str) -> None:
    """Print what a terminal of any encoding can show: a path may hold bytes that are no text at
    all.
    """
    encoding = sys.stdout.encoding or "utf-8"
    print(text.encode(encoding, "backslashreplace").decode(encoding))


class ProgressBar:
    """Runs done and failed, and time left: a line that rewrites itself on a terminal, a line a
    minute elsewhere.
    """

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
            f"[{'#' * filled}{'.' * (24 - filled)}] {progress.done}/{progress.total} runs,"
            f" {progress.failed} failed, {_minutes(progress.elapsed)} gone,"
            f" {_minutes(progress.left)} left"
        )
        self.stream.write(f"\r{line}   " + ("\n" if over else "") if live else line + "\n")
        self.stream.flush()


def _minutes(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def say_check(o: Outcome) -> str:
    return "\n".join(
        [
            f"good; {o['runs']} runs, targets {', '.join(o['targets'])}",
            *(f"  warning: {w}" for w in o["warnings"]),
        ]
    )


def say_plan(o: Outcome) -> str:
    lines = [
        f"{o['runs']} runs, {o['finished']} finished; predicted {o['core_hours']:.2f} core-hours,"
        f" {o['core_hours_left']:.2f} left"
    ]
    for name, s in o["setups"].items():
        lines.append(
            f"  {name}: {s['runs']} runs of {s['particles'][0]}-{s['particles'][1]} grains, "
            f"{s['steps'][0]:,}-{s['steps'][1]:,} steps, "
            f"{s['core_seconds_per_run'][0]:.0f}-{s['core_seconds_per_run'][1]:.0f} core-seconds"
        )
    return "\n".join(lines)


def say_runs(o: Outcome) -> str:
    text = f"{o['runs']} runs: " + ", ".join(f"{n} {kind}" for kind, n in o["statuses"].items())
    if o.get("from_shipped_database"):
        text += (
            f"; {o['from_shipped_database']} of them come with the project (same content), use"
            " --fresh to run them anew"
        )
    if o.get("missing"):
        text += f"; {o['missing']} of the plan are still missing"
    lines = [text, *(f"  {run_id} {why}" for run_id, why in o["failed"].items())]
    if len(o["yade"]) > 1:
        lines.append(
            f"  made by YADE {', '.join(o['yade'])}: numbers of different versions may differ;"
            " --fresh makes all runs anew"
        )
    if any(why.startswith(RETRIED) for why in o["failed"].values()):
        lines.append(
            "  failed runs are not tried again: for that, delete failures.json in the results"
            " folder"
        )
    return "\n".join(lines)


def say_calibrate(o: Outcome) -> str:
    best = o["candidates"]["compromise"]
    lines = [
        f"front of {o['front_size']}; compromise: {_values(best['parameters'])}"
        f" ({o['compromise_reason']})"
    ]
    lines += [f"  {sentence}" for sentence in o["reachability"]["sentences"]]
    for p in o["identifiability"]["parameters"]:
        truth = (
            ""
            if p["truth"] is None
            else (
                f"; the truth is {p['truth']:.4g}, the compromise"
                f" {best['parameters'][p['name']]:.4g}"
            )
        )
        lines.append(f"  {p['sentence']}{truth}")
    return "\n".join(lines)


def _values(values: dict[str, float]) -> str:
    return ", ".join(f"{k} = {v:.4g}" for k, v in values.items())


def say_verify(o: Outcome) -> str:
    lines = [f"{label}: {_say_verdict(v)}" for label, v in o["candidates"].items()]
    if not o["passed"]:
        lines.append(
            "  to go on: name a copy of database.csv as run.shipped and set plan.design ="
            ' "adaptive" in the case; `calibrator run` then adds runs where they decide'
        )
    return "\n".join(lines)


def say_validate(o: Outcome) -> str:
    return "\n".join(
        [_say_verdict(o), *(f"{label}: {_say_verdict(v)}" for label, v in o["candidates"].items())]
    )


def _say_verdict(o: Outcome) -> str:
    shipped = (
        f" ({o['from_shipped_database']} of its runs come with the project)"
        if o.get("from_shipped_database")
        else ""
    )
    lines = [f"{'passed' if o['passed'] else 'NOT passed'}, O1 = {o['o1']:.4f}{shipped}"]
    for r in o["responses"]:
        promise = "" if r["predicted"] is None else f", predicted {r['predicted']:.5g}"
        lines.append(
            f"  {r['key']}: target {r['target']:.5g}{promise}, simulated {r['simulated']:.5g} +-"
            f" {r['standard_error']:.2g} ({r['relative_error']:+.1%}, band"
            f" {r['band'] / abs(r['target']):.1%}): {'met' if r['passed'] else 'MISSED'}"
        )
    return "\n".join([*lines, *(f"  {run_id} {why}" for run_id, why in o["failed"].items())])


def say_preflight(o: Preflight) -> str:
    return "\n".join(o.lines)


def say_diagnose(o: Diagnosis) -> str:
    return "\n".join(o.lines)


def say_report(o: Outcome) -> str:
    return f"{o['page']}"
