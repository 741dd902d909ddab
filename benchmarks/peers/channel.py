"""A driver's end of the talk with the benchmark: one JSON object a line over stdin and stdout.

It uses the standard library only. The benchmark sends a job; the driver asks for responses and
names the sets that its peer would recommend so far, each time waiting for an answer; at the end it
hands back what the peer printed and warned of. What peers print never reaches stdout itself.
"""

import contextlib
import io
import json
import os
import sys


class Stopped(Exception):
    """The benchmark wants no more of this job."""


class Channel:
    """Asks the benchmark; raises Stopped where it says so."""

    def __init__(self):
        self._out = os.fdopen(os.dup(sys.stdout.fileno()), "w")

    def ask(self, points):
        """Responses (k, t) as lists of one run at each of the points (k, d)."""
        return self._talk({"ask": [list(map(float, p)) for p in points]})["responses"]

    def recommend(self, points):
        """Name the sets (k, d) that the peer would recommend now, the one it reports first."""
        self._talk({"recommend": [list(map(float, p)) for p in points]})

    def _talk(self, message):
        self.send(message)
        answer = json.loads(sys.stdin.readline())
        if answer.get("stop"):
            raise Stopped
        return answer

    def send(self, message):
        self._out.write(json.dumps(message) + "\n")
        self._out.flush()


def serve(calibrate):
    """Do every job that comes in: calibrate(job, channel) is one calibration by the peer."""
    channel = Channel()
    for line in iter(sys.stdin.readline, ""):
        printed, warned, error, stopped = io.StringIO(), io.StringIO(), "", False
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(warned):
            try:
                calibrate(json.loads(line), channel)
            except Stopped:
                stopped = True
            except Exception as problem:  # a peer that dies of its own is a finding
                error = f"{type(problem).__name__}: {problem}".splitlines()[0]
        said = {"said": printed.getvalue(), "warned": warned.getvalue()}
        channel.send({"end": True, "stopped": stopped, "error": error, **said})
