"""Merging, verification and status of a run in a store."""

from __future__ import annotations

import hashlib
import tempfile
from array import array
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from itertools import islice
from typing import IO

from groundray.cluster.identity import COMMON, DATASET, RECORD, SCENE, log_of, marker_of, recorded
from groundray.cluster.listing import Listed, Listing, closed, difference
from groundray.cluster.shard import ATTEMPT, HEARTBEAT_S
from groundray.cluster.store import Object, Store, Sum
from groundray.dataset import Error

Tell = Callable[[str], None]

_READERS = 8  # objects that are read at a time
_LOG_LINES = 6  # of a failed shard
_PACE = 50  # shards that the rate is computed from


def missing_shards(store: Store, shards: int) -> list[int]:
    """Returns the numbers of the shards that are not done."""
    done = {each.key for each in store.list("shards")}
    return [shard for shard in range(1, shards + 1) if marker_of(shard) not in done]


def merge(store: Store) -> str:
    """Writes dataset.yaml, whose files the shards have uploaded under their final names.

    Its text is the header and the files that all markers have in common, and between them the line
    of each frame, from the one marker that has it. Takes 8 bytes of memory per frame.
    """
    run = recorded(store)
    if missing := missing_shards(store, run.shards):
        raise Error(
            f"{store.url}: {len(missing)} of {run.shards} shards are not done, such as "
            f"{missing[0]}; run the same command again, or see groundray-cluster status"
        )
    common = (store.get(COMMON) or b"").decode()
    with tempfile.TemporaryFile() as entries, tempfile.TemporaryFile() as text:
        places = _gather(store, run.shards, common, entries)

        def lines() -> Iterator[str]:
            header, mark, files = common.partition("\nfiles:\n")
            yield f"{header}\nframes:\n"
            for place in places:
                entries.seek(place)
                yield entries.readline().decode()
            yield mark[1:] + files

        digest = hashlib.sha256()
        for each in closed(lines()):
            digest.update(each)
            text.write(each)
        there = store.sum_of(DATASET)
        if there is None:
            text.seek(0)
            store.put(DATASET, text)
        elif there != Sum(text.tell(), digest.hexdigest()):
            raise Error(f"{store.url}/{DATASET}: it is another dataset's; choose another store")
    return f"{len(places)} frames of {run.shards} shards"


def _gather(store: Store, shards: int, common: str, entries: IO[bytes]) -> array[int]:
    """Writes the lines of all frames; returns where each is, in the order of the dataset."""
    places: array[int] = array("q")
    for shard in range(1, shards + 1):
        listing = Listing(f"{store.url}/{marker_of(shard)}", store.lines(marker_of(shard)))
        places = places or array("q", [-1]) * listing.total
        if listing.shard != f'shard: "{shard}/{shards}"\n' or len(places) != listing.total:
            raise Error(f"{listing.name}: it is the marker of another shard")
        for line in listing.frames():
            place = listing.place(line)
            if places[place] >= 0:
                raise Error(f"{listing.name}: another shard has this frame too: {line[:60]}")
            places[place] = entries.tell()
            entries.write(line.encode())
        if listing.common() != common:
            how = difference(listing.common(), common)
            raise Error(f"{listing.name}: it is of another run than {COMMON}: {how}")
    if -1 in places:
        raise Error(f"{store.url}: no shard has frame {places.index(-1)} of {len(places)}")
    return places


def verify(store: Store, tell: Tell) -> tuple[int, str]:
    """Reads every object that dataset.yaml lists, and reports each fault.

    Returns the number of faults, and a summary. Takes about 200 bytes of memory per file.
    """
    run = recorded(store)
    if not store.has(DATASET):
        raise Error(f"{store.url}: it is not merged yet; run groundray-cluster merge")
    expected = {DATASET, RECORD, COMMON, SCENE}
    expected |= {key for i in range(1, run.shards + 1) for key in (marker_of(i), log_of(i))}
    listing = Listing(f"{store.url}/{DATASET}", store.lines(DATASET))
    faults, size = 0, 0

    def listed() -> Iterator[Listed]:
        for line in listing.frames():
            yield from listing.products(line)
        yield from listing.others()

    files = listed()
    with ThreadPoolExecutor(_READERS) as pool:
        while batch := list(islice(files, 8 * _READERS)):
            keys = [f"dataset/{file.path}" for file in batch]
            for file, key, found in zip(batch, keys, pool.map(store.sum_of, keys), strict=True):
                size += file.sum.size
                if found != file.sum:
                    faults += 1
                    tell(f"{key}: {'missing' if found is None else 'changed since it was written'}")
            expected.update(keys)
    for each in store.list():
        if each.key not in expected:
            faults += 1
            tell(f"{each.key}: does not belong to the run")
    count = len([key for key in expected if key.startswith("dataset/")]) - 1
    return faults, f"{count} files of {size / 2**20:.1f} MiB, {faults or 'no'} faults"


def _time(seconds: float) -> str:
    for unit, name in ((86400, "days"), (3600, "h"), (60, "min")):
        if seconds >= 2 * unit:
            return f"{seconds / unit:.1f} {name}"
    return f"{seconds:.0f} s"


def status(store: Store, tell: Tell) -> str:
    """Reports running and failed shards; returns a summary with the rate and the time left."""
    run = recorded(store)
    objects = {each.key: each for each in store.list("shards")}
    shards = range(1, run.shards + 1)
    times = sorted(objects[marker_of(i)].time for i in shards if marker_of(i) in objects)
    running = failed = 0
    for shard in shards:
        log = objects.get(log_of(shard))
        if log is None or marker_of(shard) in objects:
            continue
        lines = (store.get(log.key) or b"").decode(errors="replace").splitlines()
        states = [each for each in lines if each.startswith(ATTEMPT)]
        if states and ": failed: " in states[-1]:
            failed += 1
            tell(f"shard {shard} failed in {len(states) // 2} attempts; the end of its log:")
            for line in lines[-_LOG_LINES:]:
                tell(f"    {line}")
        elif states and states[-1].endswith(": begun"):
            running += 1
            tell(f"shard {shard} {_heard(log)}: {states[-1].removeprefix('# ')}")
    left = run.shards - len(times)
    text = f"{run.scene}, groundray {run.version}: {len(times)} of {run.shards} shards done"
    text += f", {running} running, {failed} failed, {left - running - failed} waiting"
    recent = times[-_PACE:]
    if left and len(recent) > 1 and recent[-1] > recent[0]:
        pace_s = (recent[-1] - recent[0]).total_seconds() / (len(recent) - 1)
        text += f"; {3600 / pace_s:.4g} shards/h, {_time(left * pace_s)} left"
    return text + ("" if left else "; merged" if store.has(DATASET) else "; not merged")


def _heard(log: Object) -> str:
    silent_s = (datetime.now(UTC) - log.time).total_seconds()
    is_lost = silent_s > 3 * HEARTBEAT_S
    return f"is {'perhaps lost' if is_lost else 'running'}, last heard from {_time(silent_s)} ago"
