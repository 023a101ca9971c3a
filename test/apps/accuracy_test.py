"""The table of docs/accuracy.md: its claims name tests that are there, and it tells what ran."""

import importlib.util
import json
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "build/release/bin"


def load_lister():
    spec = importlib.util.spec_from_file_location("list_accuracy", ROOT / "docs/list_accuracy.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


lister = load_lister()


def test_every_claim_names_tests_that_are_there():
    by_file, cases = lister.tests_by_file(), lister.golden_cases()
    all_tests = [name for tests in by_file.values() for name in set(tests)]
    for claim in lister.read_claims():
        names = lister.tests_of_claim(claim, by_file, cases)
        assert all(all_tests.count(name) <= 1 for name in names), "results go by the tests' names"
        assert claim["tolerance"]
        assert set(claim) <= {"claim", "tests", "golden", "how", "see", "margins", "tolerance"}
        assert (ROOT / "docs" / claim.get("see", "accuracy.md")).exists()


def test_every_golden_case_holds_a_claim():
    held = {case for claim in lister.read_claims() for case in claim.get("golden", [])}
    assert held == set(lister.golden_cases()), "docs/claims.yaml must name each case of test/golden"


@pytest.mark.parametrize("library", ["core", "terrain", "sensors", "reconstruction", "golden"])
def test_the_names_in_the_sources_are_those_of_the_programs(library):
    listed = subprocess.run(
        [PROGRAMS / f"{library}_test", "--gtest_list_tests"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    names, suite = set(), ""
    for line in listed.splitlines():
        name = line.split("#")[0].strip()
        if line.startswith(" "):
            names.add(f"{suite}.{name.split('/')[0]}")
        elif name.endswith("."):
            suite = lister.suite_of(name.rstrip("."))
    assert len(names) > 5
    assert names <= {name for tests in lister.tests_by_file().values() for name in tests}


CLAIMS = [
    {"claim": "a | b", "tests": ["Cubes.*"], "golden": ["lens"], "tolerance": "1e-9 px"},
    {"claim": "c", "tests": ["test_c"], "how": "by hand", "see": "sky.md", "tolerance": "none"},
]
CUBE = """<testsuites><testsuite name="All/Cubes"><testcase name="AreCubes/{0}" status="run"
  result="completed" timestamp="2026-01-02T03:04:05.678" classname="All/Cubes"><properties>
  <property name="margin: side" value="{1} {1} 1 px"/>
  <property name="margin: range" value="{1} {1} 1 "/>
  <property name="size" value="full"/></properties>{2}</testcase></testsuite></testsuites>"""
PYTHON = """<testsuites><testsuite><testcase classname="x" name="test_c[1]">{}</testcase>
  </testsuite></testsuites>"""


def measure(value, limit, verdict):
    return {"name": "", "value": value, "unit": "", "limit": limit, "verdict": verdict}


LENS = [
    measure(0, 0, "passed"),
    measure(3, 10, "told"),  # the worst of rows, none of which may be beyond
    measure(2, 20, "passed"),
    measure(30, 10, "told"),  # of which some may
    measure(9, None, "told"),
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Results of two parameters of one test, of a check in Python and of a case."""
    (tmp_path / "test").mkdir()
    results = [tmp_path / f"results/core/All/Cubes.AreCubes/{i}.xml" for i in range(2)]
    results[0].parent.mkdir(parents=True)
    for i, share in enumerate((0.25, 0.0123456)):
        results[i].write_text(CUBE.format(i, share, ""))
    (tmp_path / "test/core_test[1]_tests.cmake").write_text(
        "".join(f"add_test([=[x]=] y [==[--gtest_output=xml:{file}]==])\n" for file in results)
    )
    (tmp_path / "results/python.xml").write_text(PYTHON.format(""))
    write_report(tmp_path, "passed")
    by_file = {"a_test.cpp": ["Cubes.AreCubes"], "b_test.py": ["test_c"]}
    monkeypatch.setattr(lister, "tests_by_file", lambda: by_file)
    monkeypatch.setattr(lister, "golden_cases", lambda: ["lens"])
    return tmp_path


def write_report(folder, verdict):
    facts = [{"name": "version", "value": "0.1.0"}, {"name": "made with", "value": "gcc"}]
    sections = [{"title": "lens", "verdict": verdict, "measures": LENS}]
    (folder / "report.json").write_text(json.dumps({"facts": facts, "sections": sections}))


def table(folder):
    return lister.table(CLAIMS, lister.read_run(folder, folder))


def test_the_table_tells_the_margin_that_is_nearest_its_tolerance(folder):
    made = table(folder)
    assert "version 0.1.0 (gcc), 2026-01-02 to 20" in made
    assert "proofs at the size given here" in made
    assert made.splitlines()[4:] == [
        r"| a \| b | `Cubes.*`, golden `lens` | 1e-9 px | holds; side: 0.25 of 1 px; "
        "range: 25 % of the tolerance; golden: 30 % of the tolerance at most |",
        "| c | `test_c` ([sky.md](sky.md)): by hand | none | holds |",
    ]


def test_what_was_skipped_is_told(folder):
    (folder / "results/python.xml").write_text(PYTHON.format("<skipped/>"))
    assert table(folder).endswith("| none | not run here: what it needs is absent |\n")


def test_what_failed_or_did_not_run_is_an_error(folder):
    results = folder / "results/core/All/Cubes.AreCubes"
    (results / "0.xml").unlink()  # as one that crashed
    (results / "1.xml").write_text(CUBE.format(1, 0.5, "<failure message='no'/>"))
    (folder / "results/python.xml").write_text("<testsuites/>")
    write_report(folder, "failed")
    with pytest.raises(lister.AccuracyError) as fault:
        table(folder)
    for said in ("Cubes.AreCubes: failed", "Cubes.AreCubes: not run", "test_c: not run"):
        assert said in str(fault.value)
    assert "golden lens: failed" in str(fault.value)


@pytest.mark.parametrize(
    ("absent", "command"),
    [("results/python.xml", "test"), ("report.json", "golden")],
)
def test_absent_results_name_the_command_that_makes_them(folder, absent, command):
    (folder / absent).rename(folder / "elsewhere")
    with pytest.raises(lister.AccuracyError, match=f"run ./dev {command} first"):
        table(folder)


def test_the_table_stands_between_its_comments(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{lister.BEGIN}old\n{lister.END}after\n")
    for _ in range(2):
        lister.write_table(page, "new\n")
        assert page.read_text() == f"before\n{lister.BEGIN}\nnew\n\n{lister.END}after\n"
    page.write_text("neither\n")
    with pytest.raises(lister.AccuracyError, match="must have these two lines"):
        lister.write_table(page, "new\n")
