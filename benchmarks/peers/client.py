"""The benchmark's end: a peer in an environment of its own, a subprocess that talks JSON lines."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from calibrator.case.problem import Problem

HERE = Path(__file__).parent
ENVIRONMENTS = HERE.parents[1] / "build" / "peers"
REQUIRED = {"grainlearning": "grainlearning==2.0.5", "coexist": "coexist==0.3.2"}

Run = Callable[[np.ndarray], np.ndarray]
Look = Callable[[np.ndarray], None]


def python_of(name: str) -> Path:
    """Python of the peer's environment, which pip fills where it is missing (some minutes)."""
    folder = ENVIRONMENTS / name
    ready = folder / "ready"
    if not ready.exists() or ready.read_text() != REQUIRED[name]:
        print(f"installing {REQUIRED[name]} into {folder}", flush=True)
        subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
        subprocess.run([folder / "bin" / "pip", "install", "--quiet", REQUIRED[name]], check=True)
        ready.write_text(REQUIRED[name])
    return folder / "bin" / "python"


class Peer:
    """A driver that serves one calibration after another.

    Parameters on a log scale reach it as decimal logarithms.
    """

    def __init__(self, name: str) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._process = subprocess.Popen(
            [python_of(name), "-W", "always", HERE / f"drive_{name}.py"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=self._folder.name,
        )

    def calibrate(
        self,
        problem: Problem,
        run: Run,
        look: Look,
        seed: int,
        most_runs: int,
        options: dict[str, Any],
    ) -> dict[str, Any]:
        """One calibration to the peer's own end, or to most_runs.

        Parameters
        ----------
        run : points (k, d) to responses (k, t) of one run each; look : is shown the sets (k, d)
            that the peer would recommend after each of its rounds, the one it reports first;
            options : the driver's.

        Returns
        -------
        said, warned : what the peer printed, and to stderr; error : of what it died, or empty;
        stopped : whether most_runs stopped it.
        """
        logs = np.array([p.scale == "log" for p in problem.parameters])
        self._send(
            {
                "seed": seed,
                "most_runs": most_runs,
                "names": problem.names,
                "low": np.where(logs, np.log10(problem.low), problem.low).tolist(),
                "high": np.where(logs, np.log10(problem.high), problem.high).tolist(),
                "responses": [t.response for t in problem.targets],
                "targets": [t.value for t in problem.targets],
                "options": options,
            }
        )
        made = 0
        while not (message := self._receive()).get("end"):
            points = outward(problem, logs, message.get("ask") or message["recommend"])
            if "ask" not in message:
                look(points)
                self._send({})
            elif made + len(points) > most_runs:
                self._send({"stop": True})
            else:
                made += len(points)
                self._send({"responses": run(points).tolist()})
        return message

    def _send(self, message: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(message) + "\n")
        self._process.stdin.flush()

    def _receive(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"a peer's driver died (exit status {self._process.wait()})")
        return json.loads(line)

    def close(self) -> None:
        """End the driver and remove its folder."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        self._folder.cleanup()


def outward(problem: Problem, logs: np.ndarray, points: Sequence[Sequence[float]]) -> np.ndarray:
    """Points (k, d) in the problem's units, clipped to its box by no more than rounding."""
    found = np.array(points, float)
    found[:, logs] = 10 ** found[:, logs]
    return np.clip(found, problem.low, problem.high)
