"""Executors: what runs the shards of a run on this machine, a Dask cluster or a SLURM cluster."""

from __future__ import annotations

import importlib.util
import logging
import shlex
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, NamedTuple

from groundray.cluster.identity import Task
from groundray.cluster.shard import make_shard
from groundray.cluster.store import FinalError
from groundray.dataset import Error


class Job(NamedTuple):
    """Shard of a run."""

    task: Task
    shard: int

    def __str__(self) -> str:
        return f"{self.task.store}: shard {self.shard}/{self.task.shards}"


class Outcome(NamedTuple):
    """End of a job: `made`, `there` or `failed`."""

    job: Job
    state: str
    message: str = ""


def with_retries(job: Job, retries: int, stop: threading.Event | None = None) -> Outcome:
    """Makes a shard, with more attempts if some fail; never raises Error."""
    message = ""
    for _ in range(retries + 1):
        try:
            return Outcome(job, make_shard(*job, stop))
        except Error as fault:
            message = str(fault)
            if isinstance(fault, FinalError):
                break
    return Outcome(job, "failed", message)


def run_local(jobs: Sequence[Job], workers: int, retries: int) -> Iterator[Outcome]:
    """Runs shards on this machine: each worker is a thread that waits for a process groundray."""
    stop = threading.Event()
    with ThreadPoolExecutor(workers) as pool:
        try:
            futures = [pool.submit(with_retries, job, retries, stop) for job in jobs]
            for future in as_completed(futures):
                yield future.result()
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def _on_worker(job: Job) -> tuple[str, str]:
    try:
        return make_shard(*job), ""
    except FinalError as fault:  # which Dask need not repeat
        return "failed", str(fault)


def run_dask(address: str, jobs: Sequence[Job], retries: int) -> Iterator[Outcome]:
    """Runs shards on the workers of a Dask scheduler, which repeats those of lost workers."""
    if importlib.util.find_spec("distributed") is None:
        raise Error("Dask is not installed: pip install 'dask[distributed]'")
    dask: Any = importlib.import_module("distributed")
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # faults are reported here, in one line
    try:
        client = dask.Client(address)
    except (OSError, ValueError) as fault:
        raise Error(f"{address}: no scheduler answers: {fault}") from None
    with client:
        futures = {client.submit(_on_worker, job, pure=False, retries=retries): job for job in jobs}
        try:
            for future in dask.as_completed(futures):
                job, error = futures[future], future.exception()
                if future.cancelled():
                    raise ConnectionError
                state, message = ("failed", str(error)) if error else future.result()
                yield Outcome(job, state, message)
        except OSError:  # so are Dask's own
            raise Error(f"{address}: lost the scheduler; run the same command again") from None
        finally:
            client.cancel(list(futures))


def _ranges(numbers: Sequence[int]) -> str:
    """Returns ascending numbers as SLURM lists them: 1-3,7."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1] = [parts[-1][0], number]
        else:
            parts.append([number])
    return ",".join("-".join(map(str, part)) for part in parts)


def slurm_script(jobs: Sequence[Job], retries: int, options: Sequence[str]) -> str:
    """Returns the text of a job array with one task per shard of a run."""
    task = jobs[0].task
    command = [sys.executable, "-P", "-m", "groundray.cluster", "shard", task.scene]
    command += ["--store", task.store, "--groundray", task.program, "--scratch", task.scratch]
    command += ["--retries", str(retries)]
    command += ["--seed", str(task.seed)] if task.seed is not None else []
    command += ["--threads", str(task.threads)] if task.threads is not None else []
    lines = [
        "#!/bin/sh",
        "#SBATCH --job-name=groundray",
        f"#SBATCH --array={_ranges([job.shard for job in jobs])}",
        "#SBATCH --requeue",
        "#SBATCH --open-mode=append",
        *(f"#SBATCH {option}" for option in options),
        f'exec {shlex.join(command)} --shard "$SLURM_ARRAY_TASK_ID/{task.shards}"',
    ]
    return "\n".join(lines) + "\n"


def submit_slurm(script: str) -> str:
    """Submits a job array; returns the answer of sbatch."""
    try:
        sent = subprocess.run(["sbatch"], input=script, capture_output=True, text=True, check=False)
    except OSError as fault:
        raise Error(f"sbatch: {fault.strerror}; SLURM is not on this machine") from None
    if sent.returncode != 0:
        raise Error(f"sbatch: {sent.stderr.strip()}")
    return sent.stdout.strip()
