"""Outlines of pixel masks: polygons along the edges of pixels, and run lengths."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
_Corner = tuple[int, int]


def run_lengths(mask: Mask, left: int, top: int, size_px: tuple[int, int]) -> list[int]:
    """Returns COCO's run lengths: of 0 and 1 in turn, column by column, beginning with 0.

    Args:
        mask: height x width, a part of the image.
        left, top: column and row of its first pixel in the image.
        size_px: width and height of the image.
    """
    width, height = size_px
    columns, rows = np.nonzero(mask.T)
    pixels = (columns + left) * height + rows + top
    is_first = np.diff(pixels, prepend=-2) > 1
    begins, ends = pixels[is_first], pixels[np.roll(is_first, -1)] + 1
    places = np.concatenate([[0], np.stack([begins, ends], axis=1).ravel(), [width * height]])
    lengths = [int(length) for length in np.diff(places)]
    return lengths if lengths[-1] else lengths[:-1]


def polygons(mask: Mask, left: int = 0, top: int = 0) -> list[list[int]]:
    """Returns polygons x0, y0, x1, y1, … whose interiors are exactly the pixels of the mask.

    Pixel (column, row) covers the square from (column, row) to (column + 1, row + 1). A polygon
    has no hole and does not cross itself: a part with holes is cut along the columns where these
    begin. Parts that touch at a corner only have polygons of their own.

    Args:
        mask: height x width.
        left, top: column and row of its first pixel in the image.
    """
    loops = list(_loops(mask))
    holes = {min(x for x, _ in loop) for loop in loops if _doubled_area(loop) < 0}
    if holes:
        ends = [0, *sorted(holes), mask.shape[1]]
        strips = ((first, mask[:, first:end]) for first, end in pairwise(ends))
        return [each for first, strip in strips for each in polygons(strip, left + first, top)]
    return [[n for x, y in loop for n in (x + left, y + top)] for loop in loops]


def _loops(mask: Mask) -> Iterator[list[_Corner]]:
    """Yields the closed boundaries, with the mask to the right of each step (y points down)."""
    after = _steps(mask)
    for first in sorted(after):  # so that no loop begins where two pixels touch
        if first not in after:
            continue
        corner, before = first, (0, 0)
        loop: list[_Corner] = []
        while True:
            following = after[corner]
            step = following[0]
            if len(following) > 1:  # two pixels touch here: stay with the one that is followed
                step = next(s for s in following if s == (-before[1], before[0]))
            following.remove(step)
            if not following:
                del after[corner]
            if step != before:
                loop.append(corner)
            corner, before = (corner[0] + step[0], corner[1] + step[1]), step
            if corner == first:
                break
        yield loop


def _steps(mask: Mask) -> dict[_Corner, list[_Corner]]:
    """Returns the steps along edges of the mask that begin at each corner."""
    padded = np.pad(mask, 1)
    inside = padded[1:-1, 1:-1]
    edges = (
        (padded[:-2, 1:-1], (0, 0), (1, 0)),  # the pixel above, where the edge begins, its step
        (padded[1:-1, 2:], (1, 0), (0, 1)),
        (padded[2:, 1:-1], (1, 1), (-1, 0)),
        (padded[1:-1, :-2], (0, 1), (0, -1)),
    )
    after: dict[_Corner, list[_Corner]] = {}
    for beside, (x, y), step in edges:
        rows, columns = np.nonzero(inside & ~beside)
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
            after.setdefault((column + x, row + y), []).append(step)
    return after


def _doubled_area(loop: list[_Corner]) -> int:
    """Returns twice the enclosed area; negative around a hole."""
    pairs = zip(loop, loop[1:] + loop[:1], strict=True)
    return sum(x * y_next - x_next * y for (x, y), (x_next, y_next) in pairs)
