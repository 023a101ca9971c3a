"""Writes the tables of docs/accuracy/*.md and the summary of docs/accuracy.md.

    python docs/list_accuracy.py [BUILD] [GOLDEN]

BUILD is the folder with the results/ of `./dev test` and `./dev prove`, by default build/release,
and GOLDEN that of the report of `./dev golden`, by default out/golden. Every test that a claim
names must have run and passed; otherwise nothing is written, and the failed tests or missing
results are listed. A figure beyond its limit is not a failure by itself, since times exceed limits
on a busy machine. It is reported beside the claim and above the table.
"""

import json
import math
import re
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from datetime import date
from fnmatch import fnmatchcase
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
SUMMARY = ROOT / "docs/accuracy.md"
PAGES = ROOT / "docs/accuracy"
BEGIN = "<!-- What follows is by docs/list_accuracy.py, of docs/claims.yaml and the last run. -->\n"
END = "<!-- What follows is by hand. -->\n"
AT_FULL_SIZE = "at full size only"  # prefix of a proof's skip reason at a reduced size
ROUNDING = 1e-9  # relative: a figure that equals its limit is not over it


class AccuracyError(Exception):
    """An invalid claim or missing results, with location and remedy."""


@dataclass
class Result:
    """Results of a test or a golden case over all its parameters."""

    verdicts: set[str] = field(default_factory=set)  # passed, failed, skipped, not run
    margins: dict[str, tuple] = field(default_factory=dict)  # share, measured, tolerance, unit
    sizes: set[str] = field(default_factory=set)  # full, reduced; empty for tests of one size
    reasons: set[str] = field(default_factory=set)  # why it was skipped

    def add(self, verdict: str, margins: dict[str, tuple]) -> None:
        self.verdicts.add(verdict)
        keep_nearest(self.margins, margins)


@dataclass
class Run:
    """Results by test name, and the facts of the run that the page states."""

    results: dict[str, Result] = field(default_factory=dict)
    days: set[date] = field(default_factory=set)
    made_by: str = ""

    def add(self, name: str, verdict: str, margins: dict[str, tuple] | None = None) -> Result:
        result = self.results.setdefault(name, Result())
        result.add(verdict, margins or {})
        return result


def keep_nearest(margins: dict[str, tuple], others: dict[str, tuple]) -> None:
    """Keeps the margin of each name that is nearest its tolerance."""
    for name, margin in others.items():
        if name not in margins or margins[name][0] < margin[0]:
            margins[name] = margin


def read_claims() -> dict[str, list[dict]]:
    """Returns the claims of each page of docs/accuracy."""
    return yaml.safe_load((ROOT / "docs/claims.yaml").read_text())


def tests_of_file(file: Path) -> list[str]:
    """Returns the names of the tests in a source file."""
    text = file.read_text()
    if file.suffix == ".py":
        return re.findall(r"^def (test_\w+)", text, re.MULTILINE)
    pairs = re.findall(r"^(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", text, re.MULTILINE)
    return [f"{suite}.{name}" for suite, name in pairs]


def tests_by_file() -> dict[str, list[str]]:
    """Returns the names of all tests by file name."""
    files = [file for suffix in ("cpp", "py") for file in ROOT.glob(f"test/**/*_test.{suffix}")]
    by_file: dict[str, list[str]] = {}
    for file in sorted(files):
        by_file.setdefault(file.name, []).extend(tests_of_file(file))
    return by_file


def golden_cases() -> list[str]:
    return sorted(file.parent.name for file in ROOT.glob("test/golden/*/case.yaml"))


def tests_of_claim(claim: dict, by_file: dict[str, list[str]], cases: list[str]) -> list[str]:
    """Returns the names of the tests and cases that support a claim; all must exist."""
    names = []
    for test in claim.get("tests", []):
        is_file = test.endswith((".cpp", ".py"))
        found = [
            name
            for file, tests in by_file.items()
            for name in tests
            if fnmatchcase(file if is_file else name, test)
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
    """Reads a margin as written by test/support/margin.h and by tests in Python."""
    share, measured, tolerance, *unit = text.split(" ", 3)
    nearest = math.inf if math.isnan(float(share)) else float(share)
    return nearest, float(measured), float(tolerance), "".join(unit)


def is_over(margin: tuple) -> bool:
    return margin[0] > 1 + ROUNDING


def reason_of(skipped: ET.Element) -> str:
    """Returns the reason why a test was skipped, without the source location."""
    said = (skipped.get("message") or "").splitlines()
    reason = " ".join(said[1:] if len(said) > 1 else said).strip()
    return reason.replace(f"{ROOT}/", "").replace(f"{ROOT.parent}/", "../")


def add_test(test: ET.Element, name: str, run: Run) -> None:
    properties = {each.get("name"): each.get("value") for each in test.iter("property")}
    margins = {
        key.removeprefix("margin: "): margin_of(value)
        for key, value in properties.items()
        if key.startswith("margin: ")
    }
    result = run.add(name, verdict_of(test), margins)
    if "size" in properties:
        result.sizes.add(properties["size"])
    result.reasons |= {reason_of(skipped) for skipped in test.iter("skipped")}


def suite_of(name: str) -> str:
    """Returns a suite's name in the source, without its instantiation: All/Cubes, Cubes/0."""
    return next(part for part in reversed(name.split("/")) if not part.isdigit())


def listed_results(build: Path) -> list[Path]:
    """Returns the result files that CTest passes to the tests."""
    folders = (build / "test", build / "test/device")
    lists = [file for folder in folders for file in sorted(folder.glob("*_tests.cmake"))]
    lists += [file for folder in folders for file in folder.glob("CTestTestfile.cmake")]
    text = "".join(file.read_text() for file in lists)
    return [Path(file) for file in re.findall(r"--gtest_output=xml:(.*?\.xml)[\]\"]", text)]


def read_cpp_results(file: Path, run: Run) -> None:
    for test in ET.parse(file).getroot().iter("testcase"):
        if test.get("classname").startswith("Fake/"):  # a stand-in, which proves no claim
            continue
        suite = suite_of(test.get("classname"))
        add_test(test, f"{suite}.{test.get('name').split('/')[0]}", run)
        run.days.add(date.fromisoformat(test.get("timestamp")[:10]))


def read_python_results(file: Path, run: Run) -> None:
    """Replaces the run's results of the same tests."""
    found = Run()
    for test in ET.parse(file).getroot().iter("testcase"):
        add_test(test, test.get("name").split("[")[0], found)
    run.results |= found.results
    run.days.add(date.fromtimestamp(file.stat().st_mtime))


def read_golden_results(file: Path, run: Run) -> None:
    """Keeps the measure nearest its limit; not the worst row where some may exceed it."""
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
    listed = listed_results(build)
    if missing := [
        f"{file}: its tests crashed or did not run" for file in listed if not file.exists()
    ]:
        raise AccuracyError("\n".join([*missing, "run ./dev test first"]))
    for file in listed:
        read_cpp_results(file, run)
    proofs = build / "results/python_proofs.xml"  # of `./dev prove`, at full size
    for file in (python, proofs) if proofs.exists() else (python,):
        read_python_results(file, run)
    read_golden_results(report, run)
    return run


def number(value: float) -> str:
    if 1000 <= abs(value) < 1e5:
        return f"{value:.0f}"
    return f"{value:.3g}".replace("e-0", "e-").replace("e+0", "e")


def figure_of(name: str, margin: tuple) -> str:
    share, measured, tolerance, unit = margin
    if name == "golden":
        return f"golden: {share:.0%} of the tolerance at most".replace("%", " %")
    if tolerance == 1 and not unit:
        return f"{name}: {number(100 * measured)} % of the tolerance"
    if tolerance == 0 and measured == 0:
        return f"{name}: none"
    return f"{name}: {number(measured)} of {number(tolerance)} {unit}".rstrip()


def text_of_margin(name: str, margin: tuple) -> str:
    told = " (**over its limit** in this run)" if is_over(margin) else ""
    return figure_of(name, margin) + told


def why_skipped(result: Result) -> str:
    if result.reasons and all(reason.startswith(AT_FULL_SIZE) for reason in result.reasons):
        return "runs at full size only"
    return ": ".join(["lacks a prerequisite", *sorted(result.reasons - {""})])


def size_of(names: list[str], run: Run) -> str:
    """Returns the size at which tests ran, if they have two sizes."""
    sizes = {name: run.results[name].sizes for name in names if run.results[name].sizes}
    reduced = [name for name, of in sizes.items() if "reduced" in of]
    if not sizes:
        return ""
    if len(reduced) == len(sizes):
        return " at a reduced size"
    return " at full size" + "".join(f", except `{name}`" for name in reduced)


def last_run(claim: dict, names: list[str], run: Run) -> str:
    skipped = [name for name in names if "skipped" in run.results[name].verdicts]
    ran = [name for name in names if run.results[name].verdicts != {"skipped"}]
    if not ran:
        whys = dict.fromkeys(why_skipped(run.results[name]) for name in skipped)
        return "**not run here**: " + "; ".join(f"it {why}" for why in whys)
    margins = {}
    for name in ran:
        keep_nearest(margins, run.results[name].margins)
    chosen = {name: margins[name] for name in margins if name in claim.get("margins", margins)}
    is_all_held = not any(is_over(margin) for margin in chosen.values())
    said = ["holds" + size_of(ran, run) + ("" if is_all_held else ", **but over a limit**")]
    for name, margin in chosen.items():
        if name != "golden" or margin[0] > 0:
            said.append(text_of_margin(name, margin))
    for name in skipped:
        part = "a part of " if name in ran else ""
        said.append(f"without {part}`{name}`, which {why_skipped(run.results[name])}")
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
        text += f" ([{Path(claim['see']).name}](../{claim['see']}))"
    return text + (f": {claim['how']}" if "how" in claim else "")


def check(names: list[list[str]], run: Run) -> None:
    """Raises unless every test that a claim names has run and passed."""
    faults = []
    for name in dict.fromkeys(name for some in names for name in some):
        verdicts = run.results[name].verdicts if name in run.results else {"not run"}
        faults += [f"{name}: {bad}" for bad in ("failed", "not run") if bad in verdicts]
    if faults:
        raise AccuracyError("\n  ".join(["these tests support claims but did not pass:", *faults]))


def limits_told(run: Run) -> str:
    """Returns a sentence that lists the figures over their limits."""
    margins = [
        (test, name, margin)
        for test, result in run.results.items()
        for name, margin in result.margins.items()
    ]
    over = [f"`{test}`: {figure_of(name, of)}" for test, name, of in margins if is_over(of)]
    if not over:
        return f"None of the {len(margins)} figures that tests record is over its limit."
    return (
        f"**Over their limits in this run: {len(over)} of the {len(margins)} figures that tests "
        f"record**: {'; '.join(over)}."
    )


def sizes_told(names: list[list[str]], run: Run) -> str:
    """Returns a sentence with the number of rows by size."""
    sizes = [size_of(some, run) for some in names]
    growing = len(sizes) - sizes.count("")
    full, reduced = sizes.count(" at full size"), sizes.count(" at a reduced size")
    mixed = growing - full - reduced
    told = f"{full} ran at the size given here, {reduced} at a reduced size"
    told += f", {mixed} at a reduced size in part" if mixed else ""
    return f"{growing} of {len(sizes)} rows have tests of two sizes: {told}; each row says which."


def summary(names: list[list[str]], run: Run) -> str:
    """Returns what the run was, and which of its figures are over their limits."""
    days = sorted({min(run.days), max(run.days)})
    made = f"The last run: {run.made_by}, {' to '.join(map(str, days))}. {sizes_told(names, run)}"
    return f"{made}\n\n{limits_told(run)}\n"


def table(claims: list[dict], names: list[list[str]], run: Run) -> str:
    """Returns a page's table."""
    lines = ["| claim | test | tolerance, and why | last run |", "|---|---|---|---|"]
    for claim, some in zip(claims, names, strict=True):
        cells = [claim["claim"], text_of_tests(claim), claim["tolerance"]]
        cells.append(last_run(claim, some, run))
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def texts(claims: dict[str, list[dict]], run: Run) -> dict[Path, str]:
    """Returns the text between the two comments of the summary and of each page."""
    by_file, cases = tests_by_file(), golden_cases()
    names = {
        page: [tests_of_claim(claim, by_file, cases) for claim in some]
        for page, some in claims.items()
    }
    every = [some for of_page in names.values() for some in of_page]
    check(every, run)
    tables = {PAGES / f"{page}.md": table(claims[page], names[page], run) for page in claims}
    return {SUMMARY: summary(every, run)} | tables


def write_text(page: Path, made: str) -> None:
    text = page.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise AccuracyError(f"{page}: must have these two lines once: {BEGIN}{END}")
    before, rest = text.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{made}\n{END}{rest.split(END)[1]}")


def main() -> None:
    build = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/release"
    golden = Path(sys.argv[2]) if len(sys.argv) > 2 else ROOT / "out/golden"
    try:
        for page, text in texts(read_claims(), read_run(build, golden)).items():
            write_text(page, text)
    except AccuracyError as fault:
        sys.exit(f"list_accuracy: {fault}")


if __name__ == "__main__":
    main()
