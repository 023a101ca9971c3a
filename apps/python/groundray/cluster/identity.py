"""Identity of a run, which its store keeps in `run.json`, and the keys of its objects."""

from __future__ import annotations

import json
import subprocess
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from groundray.cluster.store import FinalError, Store, sum_of
from groundray.file_content import read_bytes

RECORD, COMMON, SCENE = "run.json", "common.yaml", "scene.yaml"
DATASET = "dataset/dataset.yaml"


def marker_of(shard: int) -> str:
    """Returns the key of what remains of a shard that is done: its dataset.yaml."""
    return f"shards/{shard}.done"


def log_of(shard: int) -> str:
    """Returns the key of the log of a shard's attempts."""
    return f"shards/{shard}.log"


@dataclass(frozen=True)
class Identity:
    """Inputs that determine the bytes of a run's objects, besides the files that the scene names.

    Those are compared by their fingerprint in `common.yaml`, and so are the elementary functions,
    which have the same bits on all processors and with all C libraries (core/math.h).
    """

    scene: str
    scene_sha256: str
    seed: int | None  # None: that of the scene
    version: str
    shards: int

    def claim(self, store: Store) -> None:
        """Makes the store one of this run. Raises FinalError if it is one of another run."""
        text = json.dumps(asdict(self), indent=1) + "\n"
        if store.create(RECORD, text.encode()):
            return
        there = recorded(store)
        for field in fields(self):
            ours, theirs = getattr(self, field.name), getattr(there, field.name)
            if ours != theirs and field.name != "scene":
                raise FinalError(
                    f"{store.url}: it has a run of {there.scene} with {field.name} = {theirs}, "
                    f"but this one of {self.scene} has {ours}; choose another store"
                )


def recorded(store: Store) -> Identity:
    """Reads the identity of the run in a store. Raises FinalError if there is none."""
    text = store.get(RECORD)
    if text is None:
        raise FinalError(f"{store.url}: it has no run, which groundray-cluster run would begin")
    try:
        return Identity(**json.loads(text))
    except (ValueError, TypeError):
        raise FinalError(f"{store.url}/{RECORD}: groundray-cluster did not write it") from None


@dataclass(frozen=True)
class Task:
    """Run that a worker makes shards of, as the worker sees it."""

    scene: str
    shards: int
    store: str
    seed: int | None
    program: str
    scratch: str
    threads: int | None

    def program_here(self) -> str:
        """Returns the program on this machine: by default that of the package, if it has one."""
        own = Path(__file__).parents[1] / "bin/groundray"
        return str(own) if self.program == "groundray" and own.is_file() else self.program

    def identity(self) -> Identity:
        """Reads the scene and asks the program, on this machine."""
        try:
            scene = read_bytes(Path(self.scene))
        except OSError as fault:
            raise FinalError(
                f"{self.scene}: {fault.strerror}; each machine needs the scene, and the files that "
                "it names, at the same path"
            ) from None
        name = Path(self.scene).name
        return Identity(name, sum_of(scene).sha256, self.seed, self._version(), self.shards)

    def _version(self) -> str:
        try:
            asked = subprocess.run(
                [self.program_here(), "--version"], capture_output=True, text=True, check=True
            )
        except (OSError, subprocess.CalledProcessError) as fault:
            raise FinalError(f"{self.program}: {fault}; name the program by --groundray") from None
        return asked.stdout.strip().removeprefix("groundray ")
