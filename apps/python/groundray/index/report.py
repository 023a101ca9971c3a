"""Statistics of an index as a page of HTML, which needs no other file and no network."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

from groundray.index import plots
from groundray.index.statistics import Statistics

_UNITS = {"lidar": "points", "camera": "pixels"}
_STYLE = """\
body { font: 15px/1.5 system-ui, sans-serif; max-width: 800px; margin: 2em auto; padding: 0 1em;
  color: #222; background: #fff; }
table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2em 0.8em; border-bottom: 1px solid #ddd; text-align: right; }
th:first-child, td:first-child { text-align: left; }
svg { display: block; max-width: 100%; height: auto; margin: 0.5em 0 1.5em; }
svg text { font-size: 12px; fill: #444; }
svg .label { text-anchor: end; }
svg .tick { text-anchor: middle; }
svg .grid { stroke: #ddd; }
.key { display: inline-block; width: 0.8em; height: 0.8em; border-radius: 50%;
  margin: 0 0.3em 0 1em; }
"""


def _row(cells: Iterable[str], tag: str = "td") -> str:
    return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    body = [_row(row) for row in rows]
    return [
        "<table>",
        "<thead>",
        _row(head, "th"),
        "</thead>",
        "<tbody>",
        *body,
        "</tbody>",
        "</table>",
    ]


def _legend(splits: Sequence[str]) -> str:
    keys = [
        f'<span class="key" style="background: {plots.colour_of(i)}"></span>{html.escape(split)}'
        for i, split in enumerate(splits)
    ]
    return f"<p>{''.join(keys)}</p>"


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 0.0


def _overview(of: Statistics) -> list[str]:
    kinds = [kind for kind in _UNITS if any(each == kind for _, each in of.of)]
    head = ["split", "worlds"]
    for kind in kinds:
        head += [f"{kind} frames", _UNITS[kind]]
    rows = []
    for split in of.splits:
        row = [split, f"{len(of.worlds.get(split, ())):,}"]
        for kind in kinds:
            counts = of.of_split(split, kind)
            row += [f"{counts.frames:,}", f"{counts.total:,}"]
        rows.append(row)
    return ["<h2>Splits</h2>", *_table(head, rows)]


def _section(of: Statistics, kind: str) -> list[str]:
    unit, classes = _UNITS[kind], of.classes(kind)
    shares: dict[str, dict[str, float]] = {name: {} for name in classes}
    within: dict[str, dict[str, float]] = {name: {} for name in classes}
    head, rows = ["class"], [[name] for name in classes]
    for split in of.splits:
        counts = of.of_split(split, kind)
        head += [f"{split}: {unit}", "share", "frames", "instances"]
        for row, name in zip(rows, classes, strict=True):
            each = counts.classes.get(name)
            count, frames = (each.count, each.frames) if each else (0, 0)
            shares[name][split] = _share(count, counts.total)
            within[name][split] = _share(frames, counts.counted)
            row += [f"{count:,}", plots.percent(shares[name][split]), f"{frames:,}"]
            row.append(f"{each.instances:,}" if each else "0")
    return [
        f"<h2>Classes of {kind}s</h2>",
        f"<p>Share of each class in the {unit} of a split:</p>",
        _legend(of.splits),
        plots.dot_plot(f"Share of {unit} by class", shares, of.splits, is_log=True),
        "<p>Share of the frames in which the class occurs:</p>",
        plots.dot_plot("Share of frames by class", within, of.splits, is_log=False),
        *_table(head, rows),
    ]


def _drawn(of: Statistics) -> list[str]:
    if not of.drawn:
        return []
    parts = ["<h2>Drawn values</h2>", "<p>Share of the worlds of a split:</p>", _legend(of.splits)]
    for path, values in sorted(of.drawn.items()):
        parts += [f"<h3>{html.escape(path)}</h3>", plots.histogram(path, values, of.splits)]
    return parts


def report_of(of: Statistics, name: str) -> str:
    """Returns the page. name: that of the index."""
    title = html.escape(f"Statistics of {name}")
    told = (
        "Frames of one world are in one split. A frame counts as one of a class if any of its "
        "points or pixels has it; instances are counted once in each frame that shows them."
    )
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{title}</title>",
        f"<style>\n{_STYLE}</style>",
        "</head>",
        "<body>",
        f"<h1>{title}</h1>",
        f"<p>{told}</p>",
        *_overview(of),
    ]
    for kind in of.kinds():
        parts += _section(of, kind)
    return "\n".join([*parts, *_drawn(of), "</body>", "</html>"]) + "\n"
