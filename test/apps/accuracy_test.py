"""The tables of docs/accuracy: claims name existing tests, and rows report the last run."""

import importlib.util
import json
import re
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


def every_claim():
    return [claim for page in lister.read_claims().values() for claim in page]


def test_every_page_of_claims_has_a_file():
    pages = {file.stem for file in (ROOT / "docs/accuracy").glob("*.md")}
    assert pages == set(lister.read_claims())


def test_every_claim_names_existing_tests():
    by_file, cases = lister.tests_by_file(), lister.golden_cases()
    all_tests = [name for tests in by_file.values() for name in set(tests)]
    for claim in every_claim():
        names = lister.tests_of_claim(claim, by_file, cases)
        assert all(all_tests.count(name) <= 1 for name in names), "results go by the tests' names"
        assert claim["tolerance"]
        assert set(claim) <= {"claim", "tests", "golden", "how", "see", "margins", "tolerance"}
        assert (ROOT / "docs" / claim.get("see", "accuracy.md")).exists()


def test_every_golden_case_supports_a_claim():
    held = {case for claim in every_claim() for case in claim.get("golden", [])}
    assert held == set(lister.golden_cases()), "docs/claims.yaml must name each case of test/golden"


@pytest.mark.parametrize(
    "library",
    ["core", "terrain", "sensors", "reconstruction", "golden", "apps", "view"],
)
def test_names_in_the_sources_match_the_programs(library):
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


def test_skip_reasons_of_proofs_are_recognised():
    """Skip reasons are classified by their text, and sizes are recorded while tests run."""
    sources = [file.read_text() for file in ROOT.glob("test/**/*_test.cpp")]
    skips = [
        line
        for text in sources
        for line in re.findall(r"^.*proof_size\(.*\n?.*GTEST_SKIP.*$", text, re.MULTILINE)
        if "GTEST_SKIP" in line
    ]
    for line in skips:
        assert f'<< "{lister.AT_FULL_SIZE}' in line, f"must say '{lister.AT_FULL_SIZE}': {line}"
    for text in sources:
        assert not re.search(
            r"^(const|static|constexpr|inline)\b.*proof_size\(", text, re.MULTILINE
        )


def test_claims_may_name_files_and_suites_by_wildcard():
    by_file = {"a_test.cpp": ["A.One"], "a_proof_test.cpp": ["AProof.Two"], "b_test.py": ["test_b"]}
    for pattern, expected in (
        ("a*_test.cpp", ["A.One", "AProof.Two"]),
        ("A.*", ["A.One"]),
        ("*Proof.*", ["AProof.Two"]),
        ("test_b", ["test_b"]),
    ):
        claim = {"claim": "c", "tests": [pattern]}
        assert lister.tests_of_claim(claim, by_file, []) == expected
    for pattern in ("c*_test.cpp", "B.*", "A"):
        with pytest.raises(lister.AccuracyError, match="there is no test"):
            lister.tests_of_claim({"claim": "c", "tests": [pattern]}, by_file, [])


CLAIMS = [
    {"claim": "a | b", "tests": ["Cubes.*"], "golden": ["lens"], "tolerance": "1e-9 px"},
    {
        "claim": "c",
        "tests": ["test_c"],
        "how": "by hand",
        "see": "theory/sky.md",
        "tolerance": "none",
    },
]
CUBE = """<testsuites><testsuite name="All/Cubes"><testcase name="AreCubes/{0}" status="run"
  result="completed" timestamp="2026-01-02T03:04:05.678" classname="All/Cubes"><properties>
  <property name="margin: side" value="{1} {1} 1 px"/>
  <property name="margin: range" value="{1} {1} 1 "/>
  <property name="size" value="{3}"/></properties>{2}</testcase></testsuite></testsuites>"""
PYTHON = """<testsuites><testsuite><testcase classname="x" name="test_c[1]">{}</testcase>
  </testsuite></testsuites>"""
TIME = """<properties><property name="margin: time" value="{0} {0} 1 s"/>
  <property name="size" value="{1}"/></properties>"""


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
    """Results of two parameters of one test, a check in Python and a golden case."""
    (tmp_path / "test").mkdir()
    results = [tmp_path / f"results/core/All/Cubes.AreCubes/{i}.xml" for i in range(2)]
    results[0].parent.mkdir(parents=True)
    for i, share in enumerate((0.25, 0.0123456)):
        write_cube(tmp_path, i, share)
    (tmp_path / "test/core_test[1]_tests.cmake").write_text(
        f"add_test([=[x]=] y [==[--gtest_output=xml:{results[0]}]==])\n"  # one of a proof
    )
    (tmp_path / "test/CTestTestfile.cmake").write_text(
        f'add_test(x "y" "--gtest_output=xml:{results[1]}")\n'
    )
    (tmp_path / "results/python.xml").write_text(PYTHON.format(""))
    write_report(tmp_path, "passed")
    by_file = {"a_test.cpp": ["Cubes.AreCubes"], "b_test.py": ["test_c"]}
    monkeypatch.setattr(lister, "tests_by_file", lambda: by_file)
    monkeypatch.setattr(lister, "golden_cases", lambda: ["lens"])
    return tmp_path


def write_cube(folder, i, share, inside="", size="full"):
    path = folder / f"results/core/All/Cubes.AreCubes/{i}.xml"
    path.write_text(CUBE.format(i, share, inside, size))


def write_python(folder, inside, name="python"):
    (folder / f"results/{name}.xml").write_text(PYTHON.format(inside))


def write_report(folder, verdict):
    facts = [{"name": "version", "value": "0.1.0"}, {"name": "made with", "value": "gcc"}]
    sections = [{"title": "lens", "verdict": verdict, "measures": LENS}]
    (folder / "report.json").write_text(json.dumps({"facts": facts, "sections": sections}))


def table(folder):
    """Returns the summary, and the table of a single page below it."""
    return "\n".join(lister.texts({"page": CLAIMS}, lister.read_run(folder, folder)).values())


def rows(folder):
    """Returns the last column of the two claims' rows."""
    return [line.split(" | ")[-1].removesuffix(" |") for line in table(folder).splitlines()[-2:]]


def test_the_table_shows_the_margin_nearest_its_tolerance(folder):
    made = table(folder)
    assert "version 0.1.0 (gcc), 2026-01-02 to 20" in made
    assert made.splitlines()[2:] == [
        "None of the 3 figures that tests record is over its limit.",
        "",
        "| claim | test | tolerance, and why | last run |",
        "|---|---|---|---|",
        r"| a \| b | `Cubes.*`, golden `lens` | 1e-9 px | holds at full size; side: 0.25 of 1 px; "
        "range: 25 % of the tolerance; golden: 30 % of the tolerance at most |",
        "| c | `test_c` ([sky.md](../theory/sky.md)): by hand | none | holds |",
    ]


def test_exceeded_limits_are_reported_in_their_row_and_above_the_table(folder):
    write_cube(folder, 1, 1.25)
    write_python(folder, TIME.format(2.18, "reduced"))
    assert (
        "**Over their limits in this run: 3 of the 4 figures that tests record**: "
        "`Cubes.AreCubes`: side: 1.25 of 1 px; `Cubes.AreCubes`: range: 125 % of the tolerance; "
        "`test_c`: time: 2.18 of 1 s."
    ) in table(folder).splitlines()
    assert rows(folder) == [
        "holds at full size, **but over a limit**; side: 1.25 of 1 px (**over its limit** in this "
        "run); range: 125 % of the tolerance (**over its limit** in this run); golden: 30 % of the "
        "tolerance at most",
        "holds at a reduced size, **but over a limit**; time: 2.18 of 1 s (**over its limit** in "
        "this run)",
    ]


@pytest.mark.parametrize(
    ("share", "is_over"),
    [("1", False), ("1.0000000000000058", False), ("1.001", True), ("nan", True), ("inf", True)],
)
def test_a_limit_met_within_rounding_is_not_exceeded(folder, share, is_over):
    write_cube(folder, 1, share)
    assert ("over its limit** in" in table(folder)) == is_over
    assert ("None of the 3 figures" in table(folder)) != is_over


def test_figures_with_a_limit_of_zero_are_formatted():
    assert lister.text_of_margin("rays", lister.margin_of("0 0 0 rays")) == "rays: none"
    assert lister.text_of_margin("rays", lister.margin_of("inf 3 0 rays")) == (
        "rays: 3 of 0 rays (**over its limit** in this run)"
    )
    assert lister.figure_of("bytes", lister.margin_of("0.4 414 1000 B")) == "bytes: 414 of 1000 B"
    assert lister.figure_of("off", lister.margin_of("0.2 0.03 0.15")) == "off: 0.03 of 0.15"


def test_an_exceeded_limit_is_reported_even_if_no_row_shows_it(folder, monkeypatch):
    write_cube(folder, 1, 1.25)
    monkeypatch.setitem(CLAIMS[0], "margins", ["side"])
    assert "side: 1.25 of 1 px" in rows(folder)[0]
    assert "range" not in rows(folder)[0]
    assert "`Cubes.AreCubes`: range: 125 % of the tolerance" in table(folder)


@pytest.mark.parametrize(
    ("sizes", "said", "above"),
    [
        (("full", "full"), "holds at full size", "1 ran at the size given here, 0 at a reduced"),
        (("reduced", "reduced"), "holds at a reduced size", "0 ran at the size given here, 1 at a"),
        (
            ("reduced", "full"),  # of one test's parameters
            "holds at a reduced size",
            "0 ran at the size given here, 1 at a",
        ),
    ],
)
def test_each_row_states_the_size_at_which_it_ran(folder, sizes, said, above):
    for i, size in enumerate(sizes):
        write_cube(folder, i, 0.5, size=size)
    assert rows(folder)[0].startswith(said + ";")
    assert rows(folder)[1] == "holds"  # has one size
    assert "1 of 2 rows have tests of two sizes: " + above in table(folder)


def test_a_row_of_both_sizes_names_the_reduced_tests(folder, monkeypatch):
    monkeypatch.setitem(CLAIMS[0], "tests", ["Cubes.*", "test_c"])
    write_python(folder, TIME.format(0.5, "reduced"))
    assert rows(folder)[0].startswith("holds at full size, except `test_c`; side")
    assert (
        "2 of 2 rows have tests of two sizes: 0 ran at the size given here, 1 at a reduced size, "
        "1 at a reduced size in part; each row says which."
    ) in table(folder)


def test_python_proofs_at_full_size_replace_reduced_ones(folder):
    write_python(folder, TIME.format(0.5, "reduced"))
    assert rows(folder)[1] == "holds at a reduced size; time: 0.5 of 1 s"
    write_python(folder, TIME.format(0.25, "full"), "python_proofs")
    assert rows(folder)[1] == "holds at full size; time: 0.25 of 1 s"


def skipped(why):
    return f"""<skipped message="{why}"/>"""


def test_skipped_tests_are_reported_with_their_reason(folder):
    write_python(folder, skipped(f"there is no {ROOT.parent}/shared/x.laz"))
    said = "**not run here**: it lacks a prerequisite"
    assert rows(folder)[1] == f"{said}: there is no ../shared/x.laz"
    write_python(folder, "<skipped/>")
    assert rows(folder)[1] == said


@pytest.mark.parametrize(
    ("why", "said"),
    [
        ("/a/cubes_test.cpp:7&#x0A;at full size only: takes long", "runs at full size only"),
        ("/a/cubes_test.cpp:7&#x0A;no cubes", "lacks a prerequisite: no cubes"),
    ],
)
def test_skipped_tests_are_classified_by_their_reason(folder, why, said):
    write_cube(folder, 1, 0.5, skipped(why), "reduced")
    assert rows(folder)[0].endswith(f"; without a part of `Cubes.AreCubes`, which {said}")
    write_cube(folder, 0, 0.5, skipped(why), "reduced")
    made = rows(folder)[0]  # the golden case ran
    assert made.startswith("holds; golden: 30 %")
    assert made.endswith(f"; without `Cubes.AreCubes`, which {said}")


def test_failed_tests_and_tests_that_did_not_run_are_an_error(folder):
    write_cube(folder, 1, 0.5, "<failure message='no'/>")
    (folder / "results/python.xml").write_text("<testsuites/>")
    write_report(folder, "failed")
    with pytest.raises(lister.AccuracyError) as fault:
        table(folder)
    for said in ("Cubes.AreCubes: failed", "test_c: not run"):
        assert said in str(fault.value)
    assert "golden lens: failed" in str(fault.value)


@pytest.mark.parametrize("gone", [[0], [1], [0, 1]])
def test_missing_results_of_crashed_tests_are_an_error(folder, gone):
    for i in gone:
        (folder / f"results/core/All/Cubes.AreCubes/{i}.xml").unlink()
    with pytest.raises(lister.AccuracyError) as fault:
        table(folder)
    lines = str(fault.value).splitlines()
    assert [line.count("crashed or did not run") for line in lines] == [*(1 for _ in gone), 0]
    assert lines[-1] == "run ./dev test first"


@pytest.mark.parametrize(
    ("absent", "command"),
    [("results/python.xml", "test"), ("report.json", "golden")],
)
def test_missing_results_name_the_command_that_makes_them(folder, absent, command):
    (folder / absent).rename(folder / "elsewhere")
    with pytest.raises(lister.AccuracyError, match=f"run ./dev {command} first"):
        table(folder)


def test_the_table_is_written_between_its_comments(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{lister.BEGIN}old\n{lister.END}after\n")
    for _ in range(2):
        lister.write_text(page, "new\n")
        assert page.read_text() == f"before\n{lister.BEGIN}\nnew\n\n{lister.END}after\n"
    page.write_text("neither\n")
    with pytest.raises(lister.AccuracyError, match="must have these two lines"):
        lister.write_text(page, "new\n")
