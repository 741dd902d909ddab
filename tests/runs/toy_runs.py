"""Requests, and folders in which the fake YADE misbehaves."""

import json
import time

from calibrator.runs.folder import RunFolder
from calibrator.runs.request import Request


def requests(count=4):
    return [Request.of("hourglass", seed=s) for s in range(count)]


def folder_with(tmp_path, **behaviour):
    folder = RunFolder(tmp_path / "runs")
    folder.path.mkdir()
    (folder.path / "misbehave.json").write_text(json.dumps(behaviour))
    return folder


def calls(folder):
    return (folder.path / "calls.txt").read_text().split()


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)
