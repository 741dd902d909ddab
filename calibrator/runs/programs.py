"""The programs that runs are made with: which YADE, and what is called around it."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass

from calibrator.errors import CalibratorError, shown

YADE_VARIABLE = "CALIBRATOR_YADE"
"""The environment variable by which yade_scripts/run_yade.sh learns which YADE to call."""

AROUND = {"setpriv": "util-linux", "flock": "util-linux", "timeout": "coreutils"}
"""Programs that a run on this machine is wrapped into, and Debian's packages of them."""


@dataclass(frozen=True)
class Build:
    """One build of YADE: what makes a single run, and the yade-batch that belongs to it.

    yade : name on the PATH, or path; named_by : who chose it, in words; empty for the usual one.
    """

    yade: str = "yade"
    named_by: str = ""

    @property
    def batch(self) -> str:
        """The program of a batch: YADE's own rule is to add this to whatever a build is called."""
        return f"{self.yade}-batch"

    def remedy(self) -> str:
        """What to do where a program of this build is missing."""
        if self.named_by:
            return f"correct {self.named_by}, or leave it out for the yade on the PATH"
        return f"{installing('yade')} (tried: Debian 12 and 13; in a checkout: make yade)"

    def require(self) -> None:
        """Raise CalibratorError, with the remedy, where this machine lacks one of its programs."""
        for program in (self.batch, self.yade):
            if shutil.which(program) is None:
                raise CalibratorError(f"{shown_program(program)} is not installed: {self.remedy()}")
        if shutil.which("setpriv") is None:
            raise CalibratorError(f"setpriv is not installed: {installing(AROUND['setpriv'])}")


def chosen(named: str = "") -> Build:
    """The build to be used: that of the environment's YADE, else the case's, else the usual one.

    Whoever sits at the machine has the last word.

    Parameters
    ----------
    named : what the case says under [run].
    """
    if own := os.environ.get("YADE"):
        if "/" in own:
            own = os.path.abspath(own)  # it is called in the folder of the results
        return Build(own, f"YADE={shown_program(own)} in the environment")
    return Build(named, f'yade = "{named}" under [run]') if named else Build()


def installing(package: str) -> str:
    """The command that installs a package of Debian's."""
    return f"apt-get install --no-install-recommends {package}"


def shown_program(program: str) -> str:
    """A program's name as a message gives it."""
    return program if program.isprintable() and " " not in program else shown(program)


def namespace() -> list[str]:
    """The command that cuts a program off from the network; empty where the machine allows none."""
    for command in (["unshare", "--map-root-user", "--net"], ["unshare", "--net"]):
        if (
            shutil.which("unshare")
            and subprocess.run([*command, "true"], capture_output=True).returncode == 0
        ):
            return command
    return []


def said_by(command: list[str], environment: dict[str, str], seconds: float) -> tuple[int, str]:
    """Exit status and output of a program, errors included.

    A program that cannot be started, or takes longer, has status 126.
    """
    try:
        done = subprocess.run(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=seconds,
        )
    except (OSError, ValueError) as error:
        return 126, str(error)
    except subprocess.TimeoutExpired:
        return 126, f"it did not end within {seconds:g} s"
    return done.returncode, done.stdout.decode(errors="replace")
