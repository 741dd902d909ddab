"""What the verbs print, and the progress bar."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from calibrator.case.codec import plain
from calibrator.runs.batch import Progress


def say(text: str) -> None:
    """Print what a terminal of any encoding can show.

    A path may hold bytes that are no text at all.
    """
    encoding = sys.stdout.encoding or "utf-8"
    print(text.encode(encoding, "backslashreplace").decode(encoding), flush=True)


def say_json(outcome: Any) -> None:
    """Print an outcome as JSON, as it stands in summary.json."""
    print(json.dumps(plain(outcome), indent=1, allow_nan=False), flush=True)


class ProgressBar:
    """Runs done and failed, and time left.

    A line that rewrites itself on a terminal, a line a minute elsewhere.

    Parameters
    ----------
    stage : what the runs are made for, in a word.
    """

    def __init__(self, stream: Any, stage: str = "runs") -> None:
        self.stream, self.stage = stream, stage
        self.last, self.over = float("-inf"), False

    def __call__(self, progress: Progress) -> None:
        """Show one moment of a batch."""
        live, over = self.stream.isatty(), progress.done == progress.total
        since = time.monotonic() - self.last
        if (over and self.over) or (not over and since < (0.5 if live else 60)):
            return
        self.last, self.over = time.monotonic(), over
        filled = round(24 * progress.done / max(progress.total, 1))
        again = f", {progress.retried} tried again" * bool(progress.retried)
        line = (
            f"{self.stage}: [{'#' * filled}{'.' * (24 - filled)}] {progress.done} of"
            f" {progress.total} runs, {progress.failed} failed{again},"
            f" {_minutes(progress.elapsed)} gone, {_minutes(progress.left)} left"
        )
        self.stream.write(f"\r{line}   " + ("\n" if over else "") if live else line + "\n")
        self.stream.flush()


def _minutes(seconds: float) -> str:
    """Seconds as minutes:seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
