"""A run on Dask workers that are killed at random, with a scheduler that is restarted, an S3 server
that fails and is slow for a while and attempts that are doubled, has the bytes of a single run.

GROUNDRAY_PROOF=full makes it large. The S3 server is then s3s-fs, which keeps objects on disk, if
it is on PATH or named by GROUNDRAY_S3S_FS; otherwise it is moto, which keeps them in memory.
"""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
import warnings

import pytest
from cluster_runs import (
    PACKAGE,
    PROGRAM,
    arguments,
    camera_run,
    cluster,
    faulty_program,
    started,
    wait_for,
)
from cluster_servers import (
    ON_DISK,
    Relay,
    answers,
    dataset_in,
    disk_server,
    free_port,
    make_bucket,
    memory_server,
    point_to,
    serving,
)
from groundray.cluster.store import Store

pytest.importorskip("distributed", reason="the executor dask needs distributed")
obstore = pytest.importorskip("obstore")

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
SHARDS, WORKERS, KILLS, PAUSES_S = (200, 4, 20, (1, 6)) if IS_FULL else (12, 2, 2, (0.1, 0.4))
DELAY_S = (0.2, 1) if IS_FULL else (0.05, 0.2)
DOWN_S = 25 if IS_FULL else 1  # more than an attempt at a request, less than all of them
BUCKET = "runs"


class Dask:
    """A scheduler and its workers, as processes."""

    def __init__(self, folder):
        self.folder, self.port = folder, free_port()
        self.start()

    def process(self, what, *given):
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{what}", *given, "--no-dashboard"],
            cwd=self.folder,
            env={
                **os.environ,
                "PYTHONPATH": str(PACKAGE),
                "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "100",
            },
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def start(self):
        self.scheduler = self.process("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        wait_for(lambda: answers(self.port))
        self.guards = [self.worker() for _ in range(WORKERS)]

    def worker(self):
        return self.process("worker", f"tcp://127.0.0.1:{self.port}", "--nthreads", "1")

    def revive(self):
        """Starts workers again whose guards have ended too, because they were killed early."""
        self.guards = [each if each.poll() is None else self.worker() for each in self.guards]

    def restart(self):
        """Kills the scheduler, after which workers end by themselves, and starts all again."""
        self.scheduler.kill()
        for each in (self.scheduler, *self.guards):
            each.wait(timeout=120)
        self.start()

    def workers(self):
        """Returns the processes that make shards: each is the child of a process that guards it."""
        guards = ",".join(str(guard.pid) for guard in self.guards)
        call = ["pgrep", "-P", guards, "-f", "spawn_main"]
        return subprocess.run(call, capture_output=True, text=True, check=False).stdout.split()

    def stop(self):
        for process in (*self.guards, self.scheduler):
            process.kill()  # and the workers end without their guards
            process.wait()


class FailingRelay(Relay):
    """Relay to a server that fails now and again, and worse from one tenth of the shards on: it is
    down for a while, then fails half of the time, and later, from half of the shards on, is slow.
    """

    def __init__(self, port):
        super().__init__(port)
        self.chance, self.down_since_s = random.Random(4), None

    def share_done(self):
        """Returns the share of the shards whose markers were written."""
        written = {path for method, path, _ in self.relayed if method == "PUT"}
        return sum(path.endswith(".done") for path in written) / SHARDS

    def is_failing(self, count):
        share = self.share_done()
        if share >= 0.1:
            self.down_since_s = self.down_since_s or time.monotonic()
            if time.monotonic() < self.down_since_s + DOWN_S:
                return True
        return count % (2 if 0.1 <= share < 0.3 else 10) == 0

    def delay_s(self):
        return self.chance.uniform(*DELAY_S) if 0.5 <= self.share_done() < 0.7 else 0


@contextlib.contextmanager
def s3_server(folder):
    """Runs an S3 server with a bucket: in full one on disk, if there is one."""
    if IS_FULL and ON_DISK:
        (folder / "objects" / BUCKET).mkdir(parents=True)
        with disk_server(folder / "objects") as port:
            yield port
        return
    if IS_FULL:
        warnings.warn(
            "there is no s3s-fs on PATH or in GROUNDRAY_S3S_FS: objects are in memory, in moto",
            stacklevel=1,
        )
    with memory_server() as port:
        make_bucket(port, BUCKET)
        yield port


def test_kills_restarts_failures_and_doubled_attempts_change_no_byte(tmp_path, monkeypatch, capsys):
    if not IS_FULL:  # or the command waits for half a minute for the killed scheduler
        monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "5s")
    scene, whole = camera_run(tmp_path, SHARDS + 3)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    url = f"s3://{BUCKET}/run"
    given = [*arguments(scene, url, shards=SHARDS), "--threads", 1, "--scratch", scratch]
    shard = ["shard", scene, *given[4:], "--shard"]
    chance = random.Random(3)
    with s3_server(tmp_path) as port:
        begin = time.monotonic()
        relay = FailingRelay(port)
        with serving(monkeypatch, relay):
            dask = Dask(tmp_path)
            on_dask = [*given, "--executor", f"dask://127.0.0.1:{dask.port}"]
            run, killed, runs = started(*on_dask), 0, 1
            try:
                doubled = [started(*shard, f"{i}/{SHARDS}") for i in (1, 1, 2)]
                store = Store(url)

                def done():
                    return sum(each.key.endswith(".done") for each in store.list("shards"))

                while run.poll() != 0:
                    if run.poll() is not None:
                        assert "lost the scheduler; run the same command again" in run.stderr.read()
                        run, runs = started(*on_dask), runs + 1
                    if killed < KILLS and (workers := dask.workers()):
                        os.kill(int(chance.choice(workers)), signal.SIGKILL)
                        killed += 1
                    dask.revive()
                    if runs == 1 and done() > SHARDS // 4:
                        dask.restart()
                        run.wait(timeout=120)
                    time.sleep(chance.uniform(*PAUSES_S))
                    assert time.monotonic() - begin < 3600
                for each in doubled:
                    assert each.wait(timeout=60) == 0
            finally:
                run.kill()
                dask.stop()
        took_s = time.monotonic() - begin
        assert (killed, runs) == (KILLS, 2)
        assert relay.failed > SHARDS // 2
        assert relay.delayed > SHARDS // 4
        point_to(monkeypatch, port)
        assert dataset_in(url) == whole
        assert cluster("verify", url) == 0
        summary = f"{SHARDS} shards, {KILLS} kills: {took_s:.0f} s; {relay.count} requests, "
        capsys.readouterr()

        # Another attempt at shard 2, on a faulty machine, after one that died before its marker.
        obstore.delete(Store(url)._store, "shards/2.done")
        faulty = faulty_program(tmp_path, "camera/eye/*.exr")
        assert cluster(*shard, f"2/{SHARDS}", "--groundray", faulty) == 1
        assert f"{url}/dataset/camera/eye/" in (fault := capsys.readouterr().err)
        assert ".exr: it has other bytes than this attempt made" in fault
        assert cluster(*shard, f"2/{SHARDS}", "--groundray", PROGRAM) == 0
        assert dataset_in(url) == whole
    with capsys.disabled():
        print(f"\n{summary}{relay.failed} failed, {relay.delayed} delayed")
