"""Splits of worlds: exact shares, no world in two splits, and one message for each mistake."""

import itertools
import random
from fractions import Fraction

import pytest
from groundray.dataset import Error
from groundray.index.splits import Shares, counts_of, parse_shares, split_worlds

TEXT = "train=0.8,validation=0.1,test=0.1"


def worlds_of(scenes, count):
    return [(f"{scene:016x}", number) for scene in range(scenes) for number in range(count)]


@pytest.mark.parametrize(("scenes", "count"), [(1, 3), (1, 10), (3, 7), (4, 250)])
def test_each_world_is_in_one_split_of_an_exact_share(scenes, count):
    worlds = worlds_of(scenes, count)
    split = split_worlds(worlds, Shares(parse_shares(TEXT), 5))
    assert set(split) == set(worlds)
    total = len(worlds)
    for name, share in (("train", 0.8), ("validation", 0.1), ("test", 0.1)):
        size = sum(each == name for each in split.values())
        assert size >= 1
        if total >= 10:
            assert abs(size - share * total) < 1


def test_counts_are_those_nearest_to_the_shares():
    """The oracle tries all counts and takes those with the least sum of squared deviations."""
    for total, cut in itertools.product(range(3, 25), [(0.5, 0.3), (0.7, 0.2), (0.34, 0.33)]):
        shares = [Fraction(str(cut[0])), Fraction(str(cut[1]))]
        shares.append(1 - sum(shares))
        named = Shares(tuple(zip("abc", shares, strict=True)), 0)
        counts = list(counts_of(total, named).values())
        assert sum(counts) == total
        assert min(counts) >= 1

        def cost(tried, shares=shares, total=total):
            return sum((n - share * total) ** 2 for n, share in zip(tried, shares, strict=True))

        least = min(
            cost((i, k, total - i - k)) for i in range(1, total) for k in range(1, total - i)
        )
        assert cost(counts) == least, (total, cut)


def test_a_split_depends_on_seed_scene_and_world_alone():
    worlds = worlds_of(3, 40)
    shares = Shares(parse_shares(TEXT), 1)
    split = split_worlds(worlds, shares)
    for seed in range(3):
        mixed = worlds * 2
        random.Random(seed).shuffle(mixed)
        assert split_worlds(mixed, shares) == split
    others = [split_worlds(worlds, Shares(shares.of, seed)) for seed in range(2, 6)]
    assert all(other != split for other in others)
    # Any order of the worlds is possible: a seed moves about 1 - (0.64 + 0.01 + 0.01) of them.
    for other in others:
        moved = sum(split[world] != other[world] for world in worlds) / len(worlds)
        assert 0.15 < moved < 0.55


def test_scenes_that_were_not_drawn_are_worlds_too():
    worlds = [("a" * 16, None), ("b" * 16, None), ("b" * 16, 0)]
    assert set(split_worlds(worlds, Shares(parse_shares("x=0.5,y=0.5"), 0))) == set(worlds)


@pytest.mark.parametrize(
    ("count", "rule"),
    [
        (1, "show one world, which cannot be divided among train, validation, test: "),
        (2, "show 2 worlds, which cannot be divided among train, validation, test: "),
    ],
)
def test_too_few_worlds_are_reported(count, rule):
    with pytest.raises(Error) as raised:
        split_worlds(worlds_of(1, count), Shares(parse_shares(TEXT), 0))
    assert rule in str(raised.value)
    assert "make more worlds, or leave out --split" in str(raised.value)


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("train", "'train' must be NAME=SHARE, such as train=0.8"),
        ("train=0.5,test=0.4", "the shares sum to 0.9, but must sum to 1"),
        ("train=0.5,train=0.5", "train occurs twice"),
        ("train=1,test=0", "the share of test is 0, but must be above 0 and at most 1"),
        ("train=1.2.3", "'train=1.2.3' must be NAME=SHARE"),
        ("my train=1", "'my train=1' must be NAME=SHARE"),
        ("", "'' must be NAME=SHARE"),
        ("train=nan", "'train=nan' must be NAME=SHARE"),
    ],
)
def test_texts_that_are_no_shares_are_reported(text, rule):
    with pytest.raises(ValueError, match=r".") as raised:
        parse_shares(text)
    assert rule in str(raised.value)
