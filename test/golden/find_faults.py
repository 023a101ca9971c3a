"""Verifies that the golden suite detects planted faults, in the expected cases.

Each fault of faults.yaml is a small change of the sources that makes results wrong. Each is applied
in turn to a copy of the sources, which is built and run through the suite. The check passes if all
cases pass without a fault, and if each fault fails all cases that faults.yaml lists for it.

Needs build/release/bin/groundray-golden and PyYAML; works in build/faults. Run by `./dev prove`.
"""

import argparse
import json
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
FAULTS = Path(__file__).with_name("faults.yaml")
SUITE = ROOT / "build/release/bin/groundray-golden"
FOLDER = ROOT / "build/faults"
SOURCE = FOLDER / "source"
BUILD = FOLDER / "build"


@dataclass(frozen=True)
class Fault:
    """A change of one place in one file, and the cases that it must fail."""

    name: str
    file: str
    old: str
    new: str
    found_by: list[str]


def complaints(fault: Fault) -> list[str]:
    """Returns the errors of an entry of faults.yaml."""
    path = ROOT / fault.file
    count = path.read_text().count(fault.old) if path.is_file() else 0
    wrong = []
    if count != 1:
        wrong.append(f"its old text occurs {count} times in {fault.file}; it must occur once")
    if fault.old == fault.new:
        wrong.append("its new text equals the old one")
    if not fault.found_by:
        wrong.append("found_by names no case")
    for case in fault.found_by:
        if not (ROOT / "test/golden" / case / "case.yaml").is_file():
            wrong.append(f"found_by: case '{case}' does not exist")
    return [f"{FAULTS.name}: '{fault.name}': {text}" for text in wrong]


def read_faults(words: list[str]) -> list[Fault]:
    """Returns the faults whose names contain one of the words; all faults without words."""
    faults = [Fault(**entry) for entry in yaml.safe_load(FAULTS.read_text())]
    wrong = [text for fault in faults for text in complaints(fault)]
    if len({fault.name for fault in faults}) < len(faults):
        wrong.append(f"{FAULTS.name}: two faults have the same name")
    chosen = [f for f in faults if not words or any(word in f.name for word in words)]
    if not chosen:
        wrong.append(f"{FAULTS.name}: no fault has a name with {' or '.join(words)}")
    if wrong:
        sys.exit("\n".join(wrong))
    return chosen


def copy_sources() -> None:
    """Updates the copy; unchanged files keep their times, so that they are not rebuilt."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
    names = {name for name in listed.decode().split("\0") if name and ".groundray/" not in name}
    names = {name for name in names if (ROOT / name).is_file()}
    for old in list(SOURCE.rglob("*")):
        if old.is_file() and str(old.relative_to(SOURCE)) not in names:
            old.unlink()
    for name in names:
        content, copy = (ROOT / name).read_bytes(), SOURCE / name
        if not (copy.is_file() and copy.read_bytes() == content):
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(content)


def run(*command: str | Path) -> None:
    done = subprocess.run(
        command, cwd=SOURCE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))} failed:\n{done.stdout[-4000:]}")


def configure() -> None:
    # As ./dev build does, without parts that are not needed here. Optimisation does not change
    # results. Each source is compiled separately because a fault changes only one.
    off = [
        f"GROUNDRAY_{part}=OFF"
        for part in ("TESTS", "BENCHMARKS", "GOLDEN", "VIEW", "JOIN_SOURCES")
    ]
    settings = [*off, "CMAKE_CXX_FLAGS_RELEASE=-O2"]
    run("cmake", "--preset", "release", "-B", BUILD, *(f"-D{text}" for text in settings))


def failed_cases() -> set[str]:
    """Builds the current copy and returns the cases that fail."""
    run("cmake", "--build", BUILD, "--target", "groundray")
    for certificate in list(SOURCE.rglob("*.groundray")):  # of a DEM, from an earlier run
        shutil.rmtree(certificate)
    out, report = FOLDER / "out", FOLDER / "out/report.json"
    report.unlink(missing_ok=True)
    command = [SUITE, "run", "--program", BUILD / "bin/groundray", "-o", out]
    command += ["--cases", SOURCE / "test/golden"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if not report.is_file():
        sys.exit(f"the golden suite wrote no report:\n{done.stdout[-4000:]}")
    sections = json.loads(report.read_text())["sections"]
    return {section["title"] for section in sections if section["verdict"] != "passed"}


def failed_with(fault: Fault) -> set[str]:
    file = SOURCE / fault.file
    right = file.read_text()
    try:
        file.write_text(right.replace(fault.old, fault.new))
        return failed_cases()
    finally:
        file.write_text(right)


def tell(fault: Fault, failed: set[str]) -> bool:
    """Prints the cases that detected a fault; returns whether all expected cases did."""
    must = set(fault.found_by)
    print(f"{'detected' if must <= failed else 'MISSED  '} {fault.name}")
    for what, cases in (
        ("by", must & failed),
        ("also by", failed - must),
        ("NOT by", must - failed),
    ):
        if cases:
            print(f"         {what}: {', '.join(sorted(cases))}")
    sys.stdout.flush()
    return must <= failed


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "word", nargs="*", help="use only faults whose names contain one of these words"
    )
    faults = read_faults(parser.parse_args().word)
    begin_s = time.monotonic()
    copy_sources()
    configure()
    always = failed_cases()  # independent of faults, so they detect none
    print(f"no fault: {', '.join(sorted(always))} FAILED" if always else "no fault: all cases pass")
    found = sum(tell(fault, failed_with(fault) - always) for fault in faults)
    took_min = (time.monotonic() - begin_s) / 60
    print(f"{found} of {len(faults)} faults were detected; {took_min:.0f} min")
    return 1 if always or found < len(faults) else 0


if __name__ == "__main__":
    sys.exit(main())
