"""Runs on a cluster: SLURM job arrays of yade-batch.

The queue and the record store are the only state.
A batch is a folder of tables, submitted as one array under the folder's name; each array task is
yade-batch over one table. What is in flight is what `squeue` shows by that name, so that a driver
may die at any time and be called again. A batch that the driver has given up, or done with, is
marked `settled`; a task of it that starts nevertheless ends at once.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import time
import uuid
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from calibrator.case.settings import Cluster
from calibrator.errors import CalibratorError
from calibrator.files import own_folder, parse_json, read_text, write_text
from calibrator.runs import engine
from calibrator.runs.batch import (
    Batch,
    Progress,
    batch_arguments,
    clear,
    cpu_limit,
    note_ended,
    time_limit,
)
from calibrator.runs.failures import exit_code
from calibrator.runs.folder import RunFolder
from calibrator.runs.programs import YADE_VARIABLE, Build, chosen
from calibrator.runs.record import Record
from calibrator.runs.request import Request, write_table

LONGEST_TABLE = 2000  # every run parses the whole table
POLL = 5.0  # seconds between two looks at the queue
QUEUE_TRIES = 12  # looks at a queue that does not answer before giving up
Slices = list[list[Request]]


class Slurm(engine.Engine):
    """A cluster: its jobs outlive their driver, and the next one finds them by name.

    Parameters
    ----------
    options : what SLURM is asked for.
    yade : the build of YADE that the case names; empty where it names none.
    """

    cores = None
    advice = ""

    def __init__(self, options: Cluster, yade: str = "") -> None:
        self.options = options
        self.build = chosen(yade)
        self.absent_since: dict[Path, float] = {}

    @property
    def pause(self) -> float:
        """Seconds between two looks at the queue."""
        return POLL

    def require(self) -> None:
        """Raise CalibratorError where this is no machine to submit from."""
        for program in ("sbatch", "squeue"):
            if shutil.which(program) is None:
                raise CalibratorError(
                    f"{program} is not installed here: call this on a login node, or leave out"
                    " --engine slurm"
                )

    def submit(self, folder: RunFolder, batch: Batch) -> None:
        """Write the first options.most_tasks slices of a batch, then submit them as one array."""
        options = self.options
        slices = _slices(batch, 60 * options.slice_minutes)[: options.most_tasks]
        name = f"calibrator-{time.strftime('%Y%m%d-%H%M%S')}-{uuid.uuid4().hex[:12]}"
        path = own_folder(folder.path / "batches" / name)
        self.advice = (
            f"no run started, or records were damaged meanwhile; read {path}/*.out and correct"
            " [cluster], then call again"
        )
        for index, own in enumerate(slices):
            clear(folder, own)
            cost, patience = {r.run_id: batch.cost[r.run_id] for r in own}, batch.patience(own)
            limits = time_limit(cost, patience), cpu_limit(cost, patience)
            table = f"{index}.table"
            write_table(path / table, own)
            script = _slice_script(f"batches/{name}/{table}", own, limits, self.build)
            write_text(path / f"{index}.sh", script)
        write_text(path / "job.sh", _job_script(name, options))
        manifest = [[r.run_id for r in own] for own in slices]
        write_text(path / "manifest.json", json.dumps(manifest) + "\n")
        _sbatch(folder, path, len(slices), options)

    def poll(self, folder: RunFolder, requests: Sequence[Request]) -> bool:
        """Whether a batch with any of these runs is in flight; settles those that have ended.

        The queue is asked before the record store: a run may finish in between, but it cannot
        start.
        """
        batches = _open_batches(folder, {r.run_id: r for r in requests})
        queued = _queued(batch.name for batch in batches) if batches else set()
        for batch in [b for b in batches if b.name not in queued]:
            now = time.monotonic()
            absent = now - self.absent_since.setdefault(batch, now)
            # A shared file system may show the last records later than the queue shows the end.
            if absent >= self.options.grace or all(
                _has_verdict(folder, r) for own in batches[batch] for r in own
            ):
                _settle(folder, batch, batches.pop(batch))
        return bool(batches)

    def end(self) -> None:
        """Nothing: the jobs go on, and the next driver waits for them."""

    def give_up(self, folder: RunFolder, requests: Sequence[Request]) -> None:
        """End the jobs of these runs; a task that comes up later does nothing."""
        for batch in _open_batches(folder, {r.run_id: r for r in requests}):
            (batch / "settled").touch()
            if shutil.which("scancel"):
                _ask(["scancel", f"--name={batch.name}"])


def run(
    folder: RunFolder,
    requests: Sequence[Request],
    options: Cluster,
    attempts: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
    go_on: bool = False,
) -> list[Record]:
    """Carry out requests through SLURM; see `engine.run`.

    Raises CalibratorError also where SLURM does not answer or refuses a submission.
    """
    return engine.run(Slurm(options), folder, requests, attempts, report, go_on)


def _slices(batch: Batch, seconds: float) -> Slices:
    """Cut into slices of at most so many predicted seconds and of one run at least.

    Runs that have failed equally often stay together, as their time limit is the same; the longest
    come first.
    """
    slices: Slices = []
    cost, failed, spent = batch.cost, batch.failed, 0.0
    for request in sorted(batch.requests, key=lambda r: failed[r.run_id]):
        own = slices[-1] if slices else []
        fits = own and spent + cost[request.run_id] <= seconds and len(own) < LONGEST_TABLE
        if not fits or failed[own[0].run_id] != failed[request.run_id]:
            slices.append([])
            spent = 0.0
        slices[-1].append(request)
        spent += cost[request.run_id]
    return slices


def _job_script(name: str, options: Cluster) -> str:
    """The script of an array task, which ends in that of its slice.

    options.shell is the user's own shell text, and stands there as it is.
    """
    before = [*(f"module load {module}" for module in options.modules), *options.shell]
    return JOB_SCRIPT.format(name=name, before="".join(f"{line}\n" for line in before))


# yade-batch's servers are cut off from the network where that is possible
JOB_SCRIPT = """\
#!/bin/bash -l
if [ -e batches/{name}/settled ]; then echo 'given up by its driver: nothing to do'; exit 0; fi
{before}\
export LANG=C.UTF-8 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
export PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
wall=()
if unshare --map-root-user --net true 2>/dev/null; then wall=(unshare --map-root-user --net)
elif unshare --net true 2>/dev/null; then wall=(unshare --net)
else
  echo "no network namespace: yade-batch's status page (port 9080+) can be reached from outside"
fi
. batches/{name}/$SLURM_ARRAY_TASK_ID.sh
"""


def _slice_script(
    table: str, own: Sequence[Request], limits: tuple[float, float], build: Build
) -> str:
    """The last lines of an array task: yade-batch over its table.

    limits : time by the clock and CPU time [s] of each run; build : of YADE, as the node knows it.
    """
    call = shlex.join([build.batch, *batch_arguments(table, own, 1)])
    return (
        "export CALIBRATOR_TIME_LIMIT={:.0f} CALIBRATOR_CPU_LIMIT={:.0f}".format(*limits)
        + f" {YADE_VARIABLE}={shlex.quote(build.yade)}\n"
        f'exec "${{wall[@]}}" setpriv --pdeathsig KILL {call}\n'
    )


def _sbatch(folder: RunFolder, batch: Path, tasks: int, options: Cluster) -> None:
    """Submit a batch under its own name.

    Raises CalibratorError where SLURM does not take it, which costs no attempt.
    """
    given = {
        "partition": options.partition,
        "account": options.account,
        "time": options.time,
        "mem": options.memory,
    }
    command = [
        "sbatch",
        f"--array=0-{tasks - 1}",
        f"--job-name={batch.name}",
        f"--chdir={folder.path.resolve()}",
        f"--output=batches/{batch.name}/%a.out",
        "--open-mode=append",
        "--ntasks=1",
        "--cpus-per-task=1",
        # SLURM itself starts the tasks of a lost node again, whether the driver lives or not
        "--requeue",
        "--export=PATH,HOME,USER,LOGNAME",
        *(f"--{key}={value}" for key, value in given.items() if value),
        f"{batch.resolve()}/job.sh",
    ]
    answer = _ask(command)
    # A controller that answers late may have taken the job although sbatch reports an error.
    if answer.returncode and batch.name not in _queued([batch.name]):
        (batch / "settled").touch()  # and should the job come up later still, it does nothing
        raise CalibratorError(
            f"SLURM did not take the job ({answer.stderr}): correct [cluster] in the case or site"
            " file, or wait until SLURM is well, then call again"
        )


def _ask(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL
    )


def _queued(names: Iterable[str]) -> set[str]:
    """Which of these batches have a task in the queue.

    Raises CalibratorError if SLURM does not answer for a minute.
    """
    for attempt in range(QUEUE_TRIES):
        if attempt:
            time.sleep(POLL)
        answer = _ask(["squeue", "--noheader", f"--name={','.join(names)}", "--format=%j"])
        if answer.returncode == 0:
            return {line.strip() for line in answer.stdout.splitlines()}
    raise CalibratorError(
        f"squeue does not answer ({answer.stderr}): call again when SLURM is back"
    )


def _open_batches(folder: RunFolder, by_id: dict[str, Request]) -> dict[Path, Slices]:
    """The runs of batches that are not settled, as far as they are asked for, slice by slice.

    Raises CalibratorError where a manifest is damaged.
    """
    found = {}
    for manifest in sorted(folder.path.glob("batches/*/manifest.json")):
        batch = manifest.parent
        if (batch / "settled").exists():
            continue
        try:
            slices = [
                [by_id[i] for i in own if i in by_id]
                for own in parse_json(read_text(manifest, links=False))
            ]
        except (OSError, ValueError, TypeError) as error:
            raise CalibratorError(
                f"{manifest} is damaged ({error}): end the job {batch.name}, then delete {batch}"
            ) from None
        if any(slices):
            found[batch] = slices
    return found


def _started(folder: RunFolder, request: Request) -> bool:
    return folder.log(request).exists() or folder.record(request).exists()


def _has_verdict(folder: RunFolder, request: Request) -> bool:
    return folder.record(request).exists() or exit_code(folder.log(request)) is not None


def _was_cut_off(folder: RunFolder, request: Request) -> bool:
    """Whether a run was started and then killed from outside.

    It has no record then, and no exit code of its own making.
    """
    by_a_signal = exit_code(folder.log(request)) in (None, 137, 143)
    return folder.log(request).exists() and not folder.record(request).exists() and by_a_signal


def _got_further(folder: RunFolder, batch: Path, request: Request) -> bool:
    """Whether a run has written a checkpoint since its batch was."""
    submitted = (batch / "manifest.json").stat().st_mtime
    return any(scene.stat().st_mtime > submitted for scene in folder.checkpoints(request))


def _settle(folder: RunFolder, batch: Path, slices: Slices) -> None:
    """Note the failures of a batch that has ended.

    A run that was cut off (wall time, memory, scancel) has failed only if it was the first one of
    its task, and so had all that a task is given, and yet has not come to a new checkpoint: it
    would be cut off again for ever. The others run again at no cost, as do those that never
    started; one that has a checkpoint goes on from it.
    """
    tried, ends = list[Request](), dict[str, tuple[str, str]]()
    for index, own in enumerate(slices):
        for position, request in enumerate(own):
            if not _was_cut_off(folder, request):
                tried += [request] * _started(folder, request)
            elif position == 0 and not _got_further(folder, batch, request):
                tried.append(request)
                ends[request.run_id] = _end_of_task(batch / f"{index}.out")
    note_ended(folder, tried, ends)
    (batch / "settled").touch()


def _end_of_task(output: Path) -> tuple[str, str]:
    """Kind and reason of the end of an array task, as SLURM wrote it into the task's output."""
    try:
        text = read_text(output, links=False)
    except OSError:
        text = ""
    if "DUE TO TIME LIMIT" in text:
        return "timeout", "the wall time of its array task ended: raise cluster.time"
    if re.search("oom.kill|memory limit", text, re.IGNORECASE):
        return "lost", "its array task ran out of memory: raise cluster.memory"
    return "lost", "killed from outside, or with its array task"
