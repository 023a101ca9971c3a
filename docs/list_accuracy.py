"""Writes the table of docs/accuracy.md: what is claimed (claims.yaml), and what the last run found.

    python docs/list_accuracy.py [BUILD] [GOLDEN]

BUILD is the folder whose results/ `./dev test` and `./dev prove` wrote, build/release if not given,
and GOLDEN that of the report of `./dev golden`, out/golden. Every test that a claim names must have
run and passed; else nothing is written, and the tests are listed.
"""

import json
import re
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/accuracy.md"
BEGIN = "<!-- What follows is by docs/list_accuracy.py, of docs/claims.yaml and the last run. -->\n"
END = "<!-- What follows is by hand. -->\n"


class AccuracyError(Exception):
    """Says what is wrong, where, and what to do."""


@dataclass
class Result:
    """What runs of a test or a golden case found, of all its parameters."""

    verdicts: set[str] = field(default_factory=set)  # passed, failed, skipped, not run
    margins: dict[str, tuple] = field(default_factory=dict)  # share, measured, tolerance, unit

    def add(self, verdict: str, margins: dict[str, tuple]) -> None:
        self.verdicts.add(verdict)
        keep_nearest(self.margins, margins)


@dataclass
class Run:
    """Results by the tests' names, and what the page says of the run."""

    results: dict[str, Result] = field(default_factory=dict)
    days: set[date] = field(default_factory=set)
    sizes: set[str] = field(default_factory=set)  # of proofs: full, reduced
    made_by: str = ""

    def add(self, name: str, verdict: str, margins: dict[str, tuple] | None = None) -> None:
        self.results.setdefault(name, Result()).add(verdict, margins or {})


def keep_nearest(margins: dict[str, tuple], others: dict[str, tuple]) -> None:
    """Keeps of margins of one name that which is nearest its tolerance."""
    for name, margin in others.items():
        if name not in margins or margins[name][0] < margin[0]:
            margins[name] = margin


def read_claims() -> list[dict]:
    return yaml.safe_load((ROOT / "docs/claims.yaml").read_text())


def tests_of_file(file: Path) -> list[str]:
    """Returns the names of the tests that a source file holds."""
    text = file.read_text()
    if file.suffix == ".py":
        return re.findall(r"^def (test_\w+)", text, re.MULTILINE)
    pairs = re.findall(r"^(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", text, re.MULTILINE)
    return [f"{suite}.{name}" for suite, name in pairs]


def tests_by_file() -> dict[str, list[str]]:
    """Returns the names of all tests, by the names of their files."""
    files = [file for suffix in ("cpp", "py") for file in ROOT.glob(f"test/**/*_test.{suffix}")]
    return {file.name: tests_of_file(file) for file in sorted(files)}


def golden_cases() -> list[str]:
    return sorted(file.parent.name for file in ROOT.glob("test/golden/*/case.yaml"))


def tests_of_claim(claim: dict, by_file: dict[str, list[str]], cases: list[str]) -> list[str]:
    """Returns the names of the tests and cases that hold a claim, none of which may be unknown."""
    names = []
    for test in claim.get("tests", []):
        found = by_file.get(test) or [
            name
            for tests in by_file.values()
            for name in tests
            if name == test or (test.endswith(".*") and name.startswith(test[:-1]))
        ]
        if not found:
            raise AccuracyError(f"claims.yaml: '{claim['claim']}': there is no test '{test}'")
        names += found
    for case in claim.get("golden", []):
        if case not in cases:
            raise AccuracyError(f"claims.yaml: '{claim['claim']}': there is no case '{case}'")
        names.append(f"golden {case}")
    if not names:
        raise AccuracyError(f"claims.yaml: '{claim['claim']}': names neither tests nor golden")
    return list(dict.fromkeys(names))


def verdict_of(test: ET.Element) -> str:
    if test.find("failure") is not None or test.find("error") is not None:
        return "failed"
    ran = test.get("status", "run") == "run" and test.find("skipped") is None
    return "passed" if ran else "skipped"


def margin_of(text: str) -> tuple:
    """Reads what test/support/margin.h writes."""
    share, measured, tolerance, unit = text.split(" ", 3)
    return float(share), float(measured), float(tolerance), unit


def suite_of(name: str) -> str:
    """Returns a suite as the source names it, without what instantiates it: All/Cubes, Cubes/0."""
    return next(part for part in reversed(name.split("/")) if not part.isdigit())


def listed_results(build: Path) -> list[Path]:
    """Returns the files that CTest has the tests write: one that crashed leaves none."""
    lists = sorted((build / "test").glob("*_tests.cmake"))
    text = "".join(file.read_text() for file in lists)
    return [Path(file) for file in re.findall(r"--gtest_output=xml:(.*?\.xml)\]", text)]


def read_cpp_results(file: Path, results: Path, run: Run) -> None:
    if not file.exists():
        suite, _, name = file.relative_to(results).as_posix().partition("/")[2].partition(".")
        run.add(f"{suite_of(suite)}.{name.removesuffix('.xml').split('/')[0]}", "not run")
        return
    for test in ET.parse(file).getroot().iter("testcase"):
        suite = suite_of(test.get("classname"))
        properties = {each.get("name"): each.get("value") for each in test.iter("property")}
        margins = {
            name.removeprefix("margin: "): margin_of(value)
            for name, value in properties.items()
            if name.startswith("margin: ")
        }
        run.add(f"{suite}.{test.get('name').split('/')[0]}", verdict_of(test), margins)
        run.sizes |= {properties["size"]} if "size" in properties else set()
        run.days.add(date.fromisoformat(test.get("timestamp")[:10]))


def read_python_results(file: Path, run: Run) -> None:
    for test in ET.parse(file).getroot().iter("testcase"):
        run.add(test.get("name").split("[")[0], verdict_of(test))
    run.days.add(date.fromtimestamp(file.stat().st_mtime))


def read_golden_results(file: Path, run: Run) -> None:
    """Of measures with a limit the nearest to it; where some rows may be beyond, not the worst."""
    report = json.loads(file.read_text())
    facts = {fact["name"]: fact["value"] for fact in report["facts"]}
    run.made_by = f"version {facts['version']} ({facts['made with']})"
    for case in report["sections"]:
        margins, may_exceed = {}, False
        for measure in case["measures"]:
            value, limit = measure["value"], measure["limit"] or 0
            if (
                value is not None
                and limit > 0
                and not (measure["verdict"] == "told" and may_exceed)
            ):
                margin = (value / limit, value, limit, measure["unit"])
                keep_nearest(margins, {"golden": margin})
            may_exceed = limit > 0 and measure["verdict"] != "told"
        run.add(f"golden {case['title']}", case["verdict"], margins)
    run.days.add(date.fromtimestamp(file.stat().st_mtime))


def read_run(build: Path, golden: Path) -> Run:
    run = Run()
    python, report = build / "results/python.xml", golden / "report.json"
    for file, command in ((python, "test"), (report, "golden")):
        if not file.exists():
            raise AccuracyError(f"{file}: there are no results; run ./dev {command} first")
    for file in listed_results(build):
        read_cpp_results(file, build / "results", run)
    read_python_results(python, run)
    read_golden_results(report, run)
    return run


def number(value: float) -> str:
    return f"{value:.3g}".replace("e-0", "e-").replace("e+0", "e")


def text_of_margin(name: str, margin: tuple) -> str:
    share, measured, tolerance, unit = margin
    if name == "golden":
        return f"golden: {share:.0%} of the tolerance at most".replace("%", " %")
    if tolerance == 1 and not unit:
        return f"{name}: {number(100 * measured)} % of the tolerance"
    if tolerance == 0:
        return f"{name}: none"
    return f"{name}: {number(measured)} of {number(tolerance)} {unit}".rstrip()


def last_run(claim: dict, names: list[str], run: Run) -> str:
    results = [run.results[name] for name in names]
    skipped = [name for name in names if run.results[name].verdicts == {"skipped"}]
    if len(skipped) == len(names):
        return "not run here: what it needs is absent"
    margins = {}
    for result in results:
        keep_nearest(margins, result.margins)
    chosen = [name for name in margins if name in claim.get("margins", margins)]
    chosen = [name for name in chosen if name != "golden" or margins[name][0] > 0]
    said = ["holds"] + [text_of_margin(name, margins[name]) for name in chosen]
    said += [f"without `{name}`, which needs what is absent" for name in skipped]
    return "; ".join(said)


def text_of_tests(claim: dict) -> str:
    said, last_suite = [], None
    for test in claim.get("tests", []):
        suite, _, name = test.partition(".")
        is_again = suite == last_suite and not test.endswith((".py", ".cpp"))
        said.append(f"`.{name}`" if is_again else f"`{test}`")
        last_suite = suite
    golden = ", ".join(f"`{case}`" for case in claim.get("golden", []))
    text = ", ".join(said + ([f"golden {golden}"] if golden else []))
    if "see" in claim:
        text += f" ([{claim['see']}]({claim['see']}))"
    return text + (f": {claim['how']}" if "how" in claim else "")


def check(names: list[list[str]], run: Run) -> None:
    """Every test that a claim names has run and none failed."""
    faults = []
    for name in dict.fromkeys(name for some in names for name in some):
        verdicts = run.results[name].verdicts if name in run.results else {"not run"}
        faults += [f"{name}: {bad}" for bad in ("failed", "not run") if bad in verdicts]
    if faults:
        raise AccuracyError("these hold claims but did not pass:\n  " + "\n  ".join(faults))


def table(claims: list[dict], run: Run) -> str:
    """Returns what stands between the page's two comments."""
    by_file, cases = tests_by_file(), golden_cases()
    names = [tests_of_claim(claim, by_file, cases) for claim in claims]
    check(names, run)
    days = sorted({min(run.days), max(run.days)})
    size = "at the size given here" if run.sizes == {"full"} else "at a reduced size"
    lines = [
        f"The last run: {run.made_by}, {' to '.join(map(str, days))}, proofs {size}.",
        "",
        "| claim | test | tolerance, and why | last run |",
        "|---|---|---|---|",
    ]
    for claim, some in zip(claims, names, strict=True):
        cells = [claim["claim"], text_of_tests(claim), claim["tolerance"]]
        cells.append(last_run(claim, some, run))
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def write_table(page: Path, made: str) -> None:
    text = page.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise AccuracyError(f"{page}: must have these two lines once: {BEGIN}{END}")
    before, rest = text.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{made}\n{END}{rest.split(END)[1]}")


def main() -> None:
    build = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/release"
    golden = Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "out/golden"
    try:
        write_table(PAGE, table(read_claims(), read_run(build, golden)))
    except AccuracyError as fault:
        sys.exit(f"list_accuracy: {fault}")


if __name__ == "__main__":
    main()
