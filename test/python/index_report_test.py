"""The report of groundray-index: valid HTML by itself, with the numbers of the table."""

import itertools
import re
from collections import Counter
from html.parser import HTMLParser

import pytest
from groundray.index.plots import dot_plot, histogram
from index_runs import index

parquet = pytest.importorskip("pyarrow.parquet")

VOID = {"meta", "br", "hr", "img", "link", "input"}
SPLITS = ("train", "test")


class Page(HTMLParser):
    """Elements and tables of a page; checks that each element is closed where it must be."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.tags = Counter()
        self.tables = []
        self.ids = []
        self.headings = []
        self.drawn = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags[tag] += 1
        names = [name for name, _ in attributes]
        assert len(names) == len(set(names)), tag
        for name, value in attributes:
            assert not name.startswith("on"), name
            assert name not in {"src", "href", "xlink:href"}, name
            assert value is None or "http" not in value
            if name in {"cx", "cy", "x", "y", "width", "height", "x1", "x2", "y1", "y2"}:
                assert float(value) >= 0
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append([])
        if tag == "rect":
            assert float(dict(attributes)["height"]) > 0

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in {"td", "th"}:
            self.tables[-1][-1].append(data)
        if self.open and self.open[-1] in {"h2", "h3"}:
            self.headings.append(data)
        if self.open[-2:] == ["circle", "title"]:
            self.drawn.append(data)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    options = ["--split", "train=0.5,test=0.5", "--report", folder / "report.html"]
    assert index(folder / "index.parquet", *options) == 0
    rows = parquet.read_table(folder / "index.parquet").to_pylist()
    return rows, (folder / "report.html").read_text(encoding="utf-8")


def test_the_page_is_valid_and_needs_nothing_else(made):
    _, text = made
    page = Page(text)
    assert text.startswith("<!DOCTYPE html>\n<html lang=")
    assert page.tags["script"] == page.tags["link"] == page.tags["img"] == 0
    assert page.tags["title"] >= 1
    assert page.tags["h1"] == page.tags["head"] == page.tags["body"] == 1
    assert page.tags["svg"] == 4 + 3  # two plots for each kind, and the drawn numbers
    assert page.headings == [
        *("Splits", "Classes of lidars", "Classes of cameras", "Drawn values"),
        *("objects.rock.variant", "scatter.grass.density_per_m2", "sky.sun.elevation_deg"),
    ]
    assert "@import" not in text
    assert "url(" not in text


def number(text):
    return int(text.replace(",", ""))


def test_its_numbers_are_those_of_the_table(made):
    rows, text = made
    page = Page(text)
    overview, lidars, cameras = page.tables
    for split, *cells in overview[1:]:
        mine = [row for row in rows if row["split"] == split]
        worlds, *counts = map(number, cells)
        assert worlds == len({row["world"] for row in mine}) == 3
        for kind, unit, pair in (
            ("lidar", "points", counts[:2]),
            ("camera", "pixels", counts[2:]),
        ):
            of_kind = [row for row in mine if row["kind"] == kind]
            assert pair == [len(of_kind), sum(row[unit] for row in of_kind)]
    for kind, unit, table in (("lidar", "points", lidars), ("camera", "pixels", cameras)):
        classes = {name for row in rows if row["kind"] == kind for name, _ in row["classes"]}
        assert {name for name, *_ in table[1:]} == classes
        for name, *cells in table[1:]:
            for k, split in enumerate(SPLITS):
                mine = [r for r in rows if (r["split"], r["kind"]) == (split, kind)]
                count = sum(dict(row["classes"]).get(name, 0) for row in mine)
                frames = sum(name in dict(row["classes"]) for row in mine)
                names = dict(mine[0]["labels"])
                instances = sum(
                    names.get(each["label"], f"label {each['label']}") == name
                    for row in mine
                    for each in row["instances"]
                )
                shown, share, of_frames, of_instances = cells[4 * k : 4 * k + 4]
                assert (number(shown), number(of_frames)) == (count, frames)
                assert number(of_instances) == instances
                total = sum(row[unit] for row in mine)
                assert float(share.removesuffix(" %")) == pytest.approx(
                    100 * count / total, rel=5e-3
                )
                dots = [each for each in page.drawn if each.startswith(f"{name}, {split}: ")]
                assert bool(dots) == any(
                    name in dict(r["classes"]) for r in rows if r["split"] == split
                )


def test_names_are_escaped():
    plot = dot_plot('<a & "b">', {"<i>&": {"a<b": 0.5}}, ["a<b"], is_log=True)
    page = Page(plot)
    assert page.tags["i"] == 0
    assert page.drawn == ["<i>&, a<b: 50 %"]


def test_histograms_hold_all_values_and_may_have_one():
    values = {"a": [0.0, 1.0, 1.0, 20.0], "b": [5.0]}
    page = histogram("x", values, ["a", "b"])
    shares = [float(each) for each in re.findall(r": ([\d.]+) %", page)]
    assert sum(shares) == pytest.approx(200)
    Page(page)
    Page(histogram("x", {"a": [3.0]}, ["a", "b"]))


def test_places_on_a_logarithmic_axis_are_those_of_the_decades():
    shares = {f"c{k}": {"a": 10.0**-k} for k in range(7)}
    plot = dot_plot("x", shares, ["a"], is_log=True)
    dots = [float(each) for each in re.findall(r'cx="([\d.]+)"', plot)]
    lines = [float(each) for each in re.findall(r'x1="([\d.]+)"', plot)]
    assert dots == pytest.approx(lines[::-1])
    steps = [a - b for a, b in itertools.pairwise(dots)]
    assert steps == pytest.approx([steps[0]] * 6, abs=0.2)
