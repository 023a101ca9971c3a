"""One attempt at a shard: makes it in a scratch folder, and uploads its files."""

from __future__ import annotations

import ctypes
import fcntl
import os
import platform
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from groundray.cluster.identity import COMMON, Task, log_of, marker_of
from groundray.cluster.listing import Listed, Listing, closed, difference
from groundray.cluster.store import FinalError, Store, sum_of
from groundray.dataset import Error
from groundray.file_content import read_bytes

_LIBC = ctypes.CDLL(None)  # loaded before any fork
_PR_SET_PDEATHSIG = 1
_MOST_LOG = 1 << 16  # bytes that are kept
_MOST_REASON = 500  # characters of what groundray says
_UPLOADS = 4  # at a time
ATTEMPT = "# attempt"
"""Beginning of a log's lines on attempts."""
HEARTBEAT_S = 60.0
"""Time between two copies of the log of an attempt under way."""


def make_shard(task: Task, shard: int, stop: threading.Event | None = None) -> str:
    """Makes a shard unless its marker is in the store; returns `made` or `there`.

    Raises Error, FinalError if another attempt would fail likewise, KeyboardInterrupt after `stop`.
    """
    store = Store.begin(task.store)
    task.identity().claim(store)
    if store.has(marker_of(shard)):
        return "there"
    log = _Log(store, shard)
    try:
        with _scratch_folder(Path(task.scratch)) as folder, _faults_of(task.scratch):
            _generate(task, shard, folder, log, stop or threading.Event())
            _upload(store, shard, folder / "out")
    except BaseException as fault:
        log.end("interrupted" if isinstance(fault, KeyboardInterrupt) else f"failed: {fault}")
        raise
    log.end("done")
    return "made"


class _Log:
    """Log of all attempts at a shard; its last line of `# attempt` tells how the last one stands.

    It cannot fail: an attempt does not depend on it.
    """

    def __init__(self, store: Store, shard: int) -> None:
        self._store, self._key = store, log_of(shard)
        self._before = self._output = b""
        with suppress(Error):
            self._before = store.get(self._key) or b""
        self._before += self._line("begun")
        self.put()

    @staticmethod
    def _line(state: str) -> bytes:
        place = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} on {platform.node()}"
        return f"{ATTEMPT}, {place}, process {os.getpid()}: {state}\n".encode()

    def put(self, output: Path | None = None, end: bytes = b"") -> None:
        """Copies the log, with what the program has printed, to the store."""
        if output is not None:
            self._output = read_bytes(output)
        with suppress(Error):
            self._store.put(self._key, (self._before + self._output + end)[-_MOST_LOG:])

    def end(self, state: str) -> None:
        """Adds how the attempt ended."""
        self.put(end=self._line(" ".join(state.split())))


@contextmanager
def _faults_of(scratch: str) -> Iterator[None]:
    """Raises Error for faults of the system, such as a full disk, to have attempts repeated."""
    try:
        yield
    except OSError as fault:
        raise Error(f"{fault.filename or scratch}: {fault.strerror or fault}") from None


@contextmanager
def _locked(folder: Path, how: int) -> Iterator[None]:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, how)
        yield
    finally:
        os.close(descriptor)


@contextmanager
def _scratch_folder(root: Path) -> Iterator[Path]:
    """Makes an empty folder for one attempt, and removes it at the end.

    It is locked meanwhile, so that those of attempts that were killed are known, and removed.
    """
    prefix = f"groundray-cluster-{platform.node()}-{os.getuid()}-"
    for other in root.glob(f"{prefix}*"):
        with suppress(OSError), _locked(other, fcntl.LOCK_EX | fcntl.LOCK_NB):  # unless in use
            shutil.rmtree(other, ignore_errors=True)
    with ExitStack() as held:
        try:
            folder = None
            while folder is None or not folder.exists():  # if not, another attempt has removed it
                folder = Path(tempfile.mkdtemp(prefix=prefix, dir=root))
                with suppress(FileNotFoundError):
                    held.enter_context(_locked(folder, fcntl.LOCK_EX))
            held.callback(shutil.rmtree, folder, ignore_errors=True)
        except OSError as fault:
            raise Error(f"{root}: {fault.strerror}; choose another folder by --scratch") from None
        yield folder


def _die_with(parent: int) -> None:
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it has died before
        os._exit(1)


def _generate(task: Task, shard: int, folder: Path, log: _Log, stop: threading.Event) -> None:
    command = [task.program_here(), "generate", task.scene, "-o", str(folder / "out")]
    command += ["--shard", f"{shard}/{task.shards}"]
    command += ["--seed", str(task.seed)] if task.seed is not None else []
    command += ["--threads", str(task.threads)] if task.threads is not None else []
    output = folder / "log"
    with output.open("wb") as file:
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            preexec_fn=partial(_die_with, os.getpid()),
        )
    reported_s = time.monotonic()
    try:
        while child.poll() is None:
            if stop.wait(0.1):
                raise KeyboardInterrupt
            if time.monotonic() - reported_s > HEARTBEAT_S:
                log.put(output)
                reported_s = time.monotonic()
    finally:
        child.kill()
        child.wait()
        log.put(output)
    if child.returncode == 0:
        return
    said = read_bytes(output).decode(errors="replace").rpartition("groundray: ")[2]
    why = " ".join(said.split())[:_MOST_REASON]
    if child.returncode < 0:
        names = {each.value: each.name for each in signal.Signals}
        why = f"groundray was ended by {names.get(-child.returncode, -child.returncode)}"
    raise (FinalError if child.returncode == 2 else Error)(why)


def _upload(store: Store, shard: int, out: Path) -> None:
    """Uploads each file under its final name, then the marker: dataset.yaml without pending frames.

    Before any of them, it compares what all shards have in common, so that a shard with other
    inputs adds nothing.
    """
    with (out / "dataset.yaml").open("rb") as lines:
        listing = Listing(str(out / "dataset.yaml"), lines)
        frames = list(listing.frames())
    common = listing.common()
    if not store.create(COMMON, common.encode()):
        there = (store.get(COMMON) or b"").decode()
        if there != common:
            raise FinalError(
                f"{store.url}/{COMMON}: this machine makes another run than the first shard: "
                f"{difference(common, there)}"
            )

    def upload(file: Listed) -> None:
        data = read_bytes(out / file.path)
        if sum_of(data) != file.sum:
            raise Error(f"{out / file.path}: changed since it was written; check the disk")
        store.put_once(f"dataset/{file.path}", data)

    files = [file for line in frames for file in listing.products(line)]
    with ThreadPoolExecutor(_UPLOADS) as pool:
        list(pool.map(upload, [*files, *listing.others()]))
    marker = [listing.header, listing.shard, "frames:\n", *frames, *listing.files]
    store.put_once(marker_of(shard), b"".join(closed(marker)))
