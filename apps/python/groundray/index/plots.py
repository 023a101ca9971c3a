"""Plots of the report as SVG, without any library."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping, Sequence

COLOURS = ("#2a6fbb", "#d9822b", "#3a9d6b", "#8e5bb0", "#b5485d", "#6b7785")
"""Colours of splits, in their order; repeated if there are more."""

_WIDTH, _LABELS, _ROW = 760, 150, 24
_LEAST = 1e-6  # left end of logarithmic axes


def colour_of(i: int) -> str:
    """Returns the colour of the i-th split."""
    return COLOURS[i % len(COLOURS)]


def _text(x: float, y: float, text: str, kind: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" class="{kind}">{html.escape(text)}</text>'


def _line(x: float, top: float, bottom: float) -> str:
    return f'<line x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{bottom}" class="grid"></line>'


def _svg(height: float, title: str, parts: Sequence[str]) -> str:
    name = html.escape(title, quote=True)
    view = f'viewBox="0 0 {_WIDTH} {height:g}" width="{_WIDTH}" height="{height:g}"'
    return "\n".join([f'<svg {view} role="img" aria-label="{name}">', *parts, "</svg>"])


def _log_place(share: float) -> float:
    return 1 - math.log10(max(share, _LEAST)) / math.log10(_LEAST)


def percent(share: float) -> str:
    """Returns a share as a percentage with three digits."""
    return f"{100 * share:.3g} %"


def dot_plot(
    title: str, shares: Mapping[str, Mapping[str, float]], splits: Sequence[str], *, is_log: bool
) -> str:
    """Returns a plot with a row for each class, and in it a dot for the share of each split.

    shares: from 0 to 1, by class and split; a share of 0 has no dot.
    """
    place: Callable[[float], float] = _log_place if is_log else float
    ticks = [10.0**-k for k in range(6, -1, -1)] if is_log else [k / 4 for k in range(5)]
    width, bottom = _WIDTH - _LABELS - 40, 10 + _ROW * len(shares)
    parts = []
    for tick in ticks:
        x = _LABELS + width * place(tick)
        parts.append(_line(x, 6, bottom))
        parts.append(_text(x, bottom + 16, f"{100 * tick:g} %", "tick"))
    for row, (name, of_split) in enumerate(shares.items()):
        y = 10 + _ROW * (row + 0.5)
        parts.append(_text(_LABELS - 10, y + 4, name, "label"))
        for i, split in enumerate(splits):
            share = of_split.get(split, 0.0)
            if share > 0:
                x = _LABELS + width * place(share)
                told = html.escape(f"{name}, {split}: {percent(share)}")
                dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{colour_of(i)}">'
                parts.append(f"{dot}<title>{told}</title></circle>")
    return _svg(bottom + 26, title, parts)


def histogram(title: str, values: Mapping[str, Sequence[float]], splits: Sequence[str]) -> str:
    """Returns a histogram of numbers by split: the share of each split's worlds in 20 intervals."""
    every = [value for split in splits for value in values.get(split, ())]
    low, high = min(every), max(every)
    step = (high - low) / 20 or 1.0
    shares: list[list[float]] = []
    for split in splits:
        mine = values.get(split, ())
        counts = [0] * 20
        for value in mine:
            counts[min(19, int((value - low) / step))] += 1
        shares.append([count / len(mine) if mine else 0.0 for count in counts])
    most = max(max(each) for each in shares)
    width, height = (_WIDTH - 60) / 20, 90
    parts = [_text(30, height + 26, f"{low:g}", "tick")]
    parts.append(_text(_WIDTH - 30, height + 26, f"{high:g}", "tick"))
    bar = (width - 4) / len(splits)
    for i, of_split in enumerate(shares):
        for k, share in enumerate(of_split):
            if share > 0:
                x, tall = 30 + k * width + 2 + i * bar, height * share / most
                box = f'x="{x:.1f}" y="{10 + height - tall:.1f}" width="{bar:.1f}"'
                begin, end = low + k * step, low + (k + 1) * step
                told = html.escape(f"{splits[i]}, {begin:.4g} to {end:.4g}: {percent(share)}")
                rect = f'<rect {box} height="{tall:.1f}" fill="{colour_of(i)}">'
                parts.append(f"{rect}<title>{told}</title></rect>")
    return _svg(height + 32, title, parts)
