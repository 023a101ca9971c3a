"""The command groundray-cluster."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

from groundray.cluster import merged
from groundray.cluster.executors import (
    Job,
    Outcome,
    run_dask,
    run_local,
    slurm_script,
    submit_slurm,
    with_retries,
)
from groundray.cluster.identity import SCENE, Task
from groundray.cluster.store import Store
from groundray.cluster.sweep import read_sweep, write_scene
from groundray.dataset import Error
from groundray.shell_text import add_text_options

DONE, FAILED, INTERRUPTED = 0, 1, 130  # argparse exits with 2 on wrong usage

_MOST_FAILURES = 3  # without a shard that succeeds, after which a run ends


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="groundray-cluster",
        description="Run a scene on many machines; its dataset is in an object store.",
        epilog="Stores, executors and limits: docs/reference/cluster.md. Exit codes: "
        "0 done, 1 failed, 2 wrong usage, 130 interrupted. The same command continues a run.",
        allow_abbrev=False,
    )
    add_text_options(parser)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, text: str) -> argparse.ArgumentParser:
        return commands.add_parser(name, help=text, description=text, allow_abbrev=False)

    run = command("run", "Make all shards of a scene that the store does not have, and merge them.")
    _add_scene(run)
    run.add_argument("--shards", type=_positive, required=True, metavar="N", help="number of parts")
    _add_executor(run)
    sweep = command("sweep", "Run a scene over a table of parameters, one dataset each.")
    sweep.add_argument("params", metavar="PARAMS.yaml", type=Path, help="table of parameters")
    sweep.set_defaults(seed=None)
    _add_executor(sweep)
    shard = command("shard", "Make one shard, as a task of a job array does.")
    _add_scene(shard)
    text = "number of the shard, from 1, and number of all"
    shard.add_argument("--shard", type=_shard, required=True, metavar="I/N", help=text)
    for each in (run, sweep, shard):
        _add_attempts(each)
    for name, text in (
        ("merge", "Write dataset.yaml of a run whose shards are done."),
        ("status", "Show how far a run is, its rate, and the logs of failed shards."),
        ("verify", "Read all files of a merged dataset and compare their checksums."),
    ):
        command(name, text).add_argument("store", metavar="STORE", help="as for run --store")
    return parser


def _add_scene(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE", type=Path, help="scene file")
    parser.add_argument("--seed", type=_whole, metavar="S", help="seed instead of the scene's")


def _add_attempts(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--store", required=True, metavar="URL", help="s3://BUCKET/PREFIX or file:///FOLDER")
    text = "more attempts at a shard that fails (default: 2)"
    add("--retries", type=_whole, default=2, metavar="R", help=text)
    text = "folder for the files of shards under way (default: that of temporary files)"
    add("--scratch", type=Path, default=Path(tempfile.gettempdir()), metavar="FOLDER", help=text)
    text = "program that makes frames (default: that of the Python package, or else of the PATH)"
    add("--groundray", default="groundray", metavar="PROGRAM", help=text)
    text = "threads of each groundray (default: all cores, divided among local workers)"
    add("--threads", type=_positive, metavar="T", help=text)


def _add_executor(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    text = "local, dask://HOST:PORT or slurm (default: local)"
    add("--executor", type=_executor, default="local", metavar="E", help=text)
    text = "shards at a time on this machine (default: 1)"
    add("--workers", type=_positive, metavar="W", help=text)
    text = "option of sbatch, such as --sbatch=--partition=long; may be repeated"
    add("--sbatch", action="append", metavar="OPTION", help=text)
    text = "print the scripts for SLURM, but submit nothing"
    add("--print-script", action="store_true", help=text)


def _whole(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text} must be a whole number")
    return int(text)


def _positive(text: str) -> int:
    if not 1 <= _whole(text) <= 1_000_000:
        raise argparse.ArgumentTypeError(f"{text} must be from 1 to 1000000")
    return int(text)


def _shard(text: str) -> tuple[int, int]:
    index, slash, count = text.partition("/")
    if not slash or not 1 <= _whole(index) <= _positive(count):
        raise argparse.ArgumentTypeError(f"{text} must be I/N, with I from 1 to N")
    return int(index), int(count)


def _executor(text: str) -> str:
    if text not in ("local", "slurm") and not text.startswith("dask://"):
        raise argparse.ArgumentTypeError(f"{text} must be local, dask://HOST:PORT or slurm")
    return text


def _check_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.command not in ("run", "sweep"):
        return
    if options.workers and options.executor != "local":
        parser.error(f"--workers applies to local, not to {options.executor}")
    if (options.sbatch or options.print_script) and options.executor != "slurm":
        parser.error(f"--sbatch and --print-script apply to slurm, not to {options.executor}")


def _task(options: argparse.Namespace, scene: Path, store: str, shards: int) -> Task:
    threads = options.threads
    if threads is None and getattr(options, "executor", "") == "local":
        threads = max(1, (os.cpu_count() or 1) // (options.workers or 1))
    program = options.groundray  # a name is looked up by each machine
    program = str(Path(program).absolute()) if "/" in program else program
    scratch = str(options.scratch.absolute())
    place = str(scene.absolute())
    return Task(place, shards, Store.begin(store).url, options.seed, program, scratch, threads)


def _outcomes(options: argparse.Namespace, jobs: Sequence[Job]) -> Iterator[Outcome]:
    if options.executor == "local":
        return run_local(jobs, options.workers or 1, options.retries)
    address = options.executor.replace("dask://", "tcp://")
    return run_dask(address, jobs, options.retries)


def _run(options: argparse.Namespace, tasks: Sequence[Task]) -> str:
    """Makes the shards that are missing, then merges; with SLURM, submits them."""
    jobs = []
    for task in tasks:
        store = Store(task.store)
        task.identity().claim(store)
        jobs += [Job(task, shard) for shard in merged.missing_shards(store, task.shards)]
    total = sum(task.shards for task in tasks)
    count = total - len(jobs)
    if options.executor == "slurm":
        return _submit(options, jobs)
    failed: list[Outcome] = []
    if jobs:
        with closing(_outcomes(options, jobs)) as outcomes:  # type: ignore[type-var]
            for outcome in outcomes:
                if outcome.state == "failed":
                    failed.append(outcome)
                    print(f"{outcome.job} failed: {outcome.message}", file=sys.stderr)
                    if len(failed) == _MOST_FAILURES and count == 0:
                        break
                else:
                    count += 1
                    print(f"{outcome.job} {outcome.state}, {count} of {total}", flush=True)
    if failed:
        raise Error(
            f"{len(failed)} shards failed, {count} of {total} are done: {failed[0].message}"
        )
    lines = [f"{task.store}: {merged.merge(Store(task.store))}" for task in tasks]
    return "\n".join(lines)


def _submit(options: argparse.Namespace, jobs: Sequence[Job]) -> str:
    lines = []
    for store in dict.fromkeys(job.task.store for job in jobs):
        mine = [job for job in jobs if job.task.store == store]
        script = slurm_script(mine, options.retries, options.sbatch or [])
        lines.append(script.rstrip() if options.print_script else submit_slurm(script))
    return "\n".join(lines) or "all shards are done; merge them with groundray-cluster merge"


def _sweep(options: argparse.Namespace) -> str:
    sweep = read_sweep(options.params)
    tasks = []
    for run in sweep.runs:
        task = _task(
            options,
            write_scene(sweep, run),
            f"{options.store.rstrip('/')}/{run.name}",
            sweep.shards,
        )
        store = Store(task.store)
        task.identity().claim(store)
        store.put_once(SCENE, run.scene)
        print(f"{task.store}: {run.parameters}", flush=True)
        tasks.append(task)
    return _run(options, tasks)


def _shard_alone(options: argparse.Namespace) -> str:
    index, count = options.shard
    outcome = with_retries(
        Job(_task(options, options.scene, options.store, count), index), options.retries
    )
    if outcome.state == "failed":
        raise Error(outcome.message)
    return f"{outcome.job} {outcome.state}"


def _work(options: argparse.Namespace) -> tuple[int, str]:
    if options.command == "run":
        task = _task(options, options.scene, options.store, options.shards)
        return DONE, _run(options, [task])
    if options.command == "sweep":
        return DONE, _sweep(options)
    if options.command == "shard":
        return DONE, _shard_alone(options)
    store = Store(options.store)
    if options.command == "merge":
        return DONE, f"{store.url}: {merged.merge(store)}"
    if options.command == "status":
        return DONE, f"{store.url}: {merged.status(store, print)}"
    faults, message = merged.verify(store, print)
    return FAILED if faults else DONE, f"{store.url}: {message}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    _check_options(parser, options)
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        code, message = _work(options)
        print(message)
        return code
    except KeyboardInterrupt:
        code, message = INTERRUPTED, "interrupted; the same command continues"
    except Error as fault:
        code, message = FAILED, str(fault)
    except OSError as fault:
        place = f"{fault.filename}: " if fault.filename else ""
        code, message = FAILED, f"{place}{fault.strerror or fault}"
    finally:
        signal.signal(signal.SIGTERM, before)
    print(f"groundray-cluster: {message}", file=sys.stderr)
    return code
