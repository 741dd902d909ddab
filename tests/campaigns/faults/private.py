"""Mounts that no other process sees."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys


def mount(*arguments: str) -> None:
    """Mount something; it is seen by this process and its children only, see `in_private`."""
    subprocess.run(["mount", *arguments], check=True)


def in_private(module: str, arguments: list[str]) -> None:
    """Start a module again where its mounts are its own business.

    Returns only where that has been done, or cannot be. Sets FAULTS_PRIVATE to "yes" or "no".
    """
    if "FAULTS_PRIVATE" in os.environ:
        return
    os.environ["FAULTS_PRIVATE"] = "no"
    for namespace in (["unshare", "--map-root-user", "--mount"], ["unshare", "--mount"]):
        if (
            shutil.which("unshare")
            and subprocess.run([*namespace, "true"], capture_output=True).returncode == 0
        ):
            os.environ["FAULTS_PRIVATE"] = "yes"
            os.execvp("unshare", [*namespace, sys.executable, "-m", module, *arguments])
