"""Options on pages of docs exist in the programs."""

import functools
import re
import subprocess
from pathlib import Path

from markdown_page import PAGES, ROOT, Page, name_of

PROGRAMS = ROOT / "build/release/bin"
COMMANDS = {
    "groundray": [
        *("generate", "sample", "voxels", "verify", "merge", "info", "list", "traversability"),
        *(f"terrain {what}" for what in ("mesh", "certify", "fill")),
        *(f"reconstruct {what}" for what in ("mesh", "simplify", "fill", "dem")),
    ],
    "groundray-golden": ["run", "accept", "compare", "passes", "conform"],
    "groundray-view": [],
    "groundray-export": [],
    "groundray-index": [],
    "groundray-cluster": ["run", "sweep", "shard", "merge", "status", "verify"],
}
OTHERS = {"--array", "--cuda", "--hip", "--opencl"}  # Slurm's, and those of ./dev bench device
# A command, up to where a shell or a sentence would end it.
CALL = re.compile(
    r"(?<![\w/.-])(groundray(?:-golden|-view|-export|-index|-cluster)?)(?= )([^|;&`#\n]*)"
)


@functools.cache
def help_of(program: str, command: str) -> str:
    result = subprocess.run(
        [PROGRAMS / program, *command.split(), "--help"],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return result.stdout


def code_of(path: Path) -> str:
    """Returns blocks, indented lines and inline code, one command per line."""
    page = Page(path)
    text = path.read_text(encoding="utf-8")
    indented = [line[4:] for line in text.splitlines() if line.startswith("    ")]
    within = re.findall(r"`([^`]+)`", "\n".join(page.prose))
    pieces = [*(block.text for block in page.blocks), "\n".join(indented)]
    return (
        "\n".join(pieces).replace("\\\n", " ")
        + "\n"
        + "\n".join(c.replace("\n", " ") for c in within)
    )


def has(option: str, text: str) -> bool:
    return re.search(rf"(?<![\w-]){option}(?![\w-])", text) is not None


def unknown_options(path: Path) -> list[str]:
    unknown = []
    for program, rest in CALL.findall(code_of(path)):
        named = [name for name in COMMANDS[program] if re.match(rf" {name}\b", rest)]
        known = help_of(program, named[0] if named else "")
        for option in re.findall(r"(?<![\w-])--[a-z][\w-]*", rest):
            if not has(option, known):
                unknown.append(f"{name_of(path)}: {program}{rest.rstrip()}: there is no {option}")
    return unknown


def test_options_of_commands_on_pages_exist() -> None:
    unknown = [fault for path in PAGES for fault in unknown_options(path)]
    assert not unknown, "\n".join(unknown)


def test_options_named_alone_on_pages_exist() -> None:
    known = "".join(
        help_of(program, name) for program, names in COMMANDS.items() for name in ["", *names]
    )
    unknown = [
        f"{name_of(path)}: no program has {option}"
        for path in PAGES
        for option in re.findall(r"`(--[a-z][\w-]*)[^`]*`", "\n".join(Page(path).prose))
        if option not in OTHERS and not has(option, known)
    ]
    assert not unknown, "\n".join(unknown)


def test_enough_commands_are_checked() -> None:
    calls = [call for path in PAGES for call in CALL.findall(code_of(path))]
    assert sum("--" in rest for _, rest in calls) > 25
