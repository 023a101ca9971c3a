"""Splits of worlds, such as train, validation and test, in exact shares."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection
from dataclasses import dataclass
from fractions import Fraction

from groundray.dataset import Error

World = tuple[str, int | None]
"""A scene, and the number of its world; None for a scene that was not drawn."""


@dataclass(frozen=True)
class Shares:
    """Names of splits with their shares of the worlds, which sum to 1, and a seed."""

    of: tuple[tuple[str, Fraction], ...]
    seed: int

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the splits, in the given order."""
        return tuple(name for name, _ in self.of)


def parse_shares(text: str) -> tuple[tuple[str, Fraction], ...]:
    """Converts `train=0.8,test=0.2` to names and shares.

    Raises ValueError with the rule if it is not such a text.
    """
    shares: dict[str, Fraction] = {}
    for each in text.split(","):
        name, _, share = each.partition("=")
        if not re.fullmatch(r"[A-Za-z0-9_-]+", name) or not re.fullmatch(r"[0-9.]+", share):
            raise ValueError(f"'{each}' must be NAME=SHARE, such as train=0.8")
        try:
            value = Fraction(share)
        except ValueError:
            raise ValueError(f"'{each}' must be NAME=SHARE, such as train=0.8") from None
        if name in shares:
            raise ValueError(f"{name} occurs twice")
        if not 0 < value <= 1:
            raise ValueError(f"the share of {name} is {share}, but must be above 0 and at most 1")
        shares[name] = value
    total = sum(shares.values())
    if total != 1:
        raise ValueError(f"the shares sum to {float(total):g}, but must sum to 1")
    return tuple(shares.items())


def counts_of(worlds: int, shares: Shares) -> dict[str, int]:
    """Returns the number of worlds of each split: at least 1, and within 1 of its share if that
    permits it. Raises Error if there are fewer worlds than splits.
    """
    if worlds < len(shares.of):
        has = "one world" if worlds == 1 else f"{worlds} worlds"
        rule = f"the datasets show {has}, which cannot be divided among {', '.join(shares.names)}"
        fix = "frames of one world never go into two splits: make more worlds, or leave out --split"
        raise Error(f"{rule}: {fix}")
    counts = {name: int(share * worlds) for name, share in shares.of}  # rounded down
    left = worlds - sum(counts.values())
    by_remainder = sorted(shares.of, key=lambda each: counts[each[0]] - each[1] * worlds)
    for name, _ in by_remainder[:left]:
        counts[name] += 1
    for name in counts:
        if counts[name] == 0:
            counts[max(counts, key=lambda each: counts[each])] -= 1
            counts[name] = 1
    return counts


def split_worlds(worlds: Collection[World], shares: Shares) -> dict[World, str]:
    """Returns the split of each world: the worlds are sorted by a hash, and divided in the order
    of the splits. Raises Error if there are fewer worlds than splits.
    """
    ordered = sorted(set(worlds), key=lambda world: _hash(shares.seed, world))
    split: dict[World, str] = {}
    for name, count in counts_of(len(ordered), shares).items():
        split |= dict.fromkeys(ordered[len(split) : len(split) + count], name)
    return split


def _hash(seed: int, world: World) -> bytes:
    scene, number = world
    return hashlib.sha256(f"{seed} {scene} {'' if number is None else number}".encode()).digest()
