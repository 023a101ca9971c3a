"""Parses Markdown pages for the tests of docs: fenced blocks, headings, links."""

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^(`{3,})(.*)$")
HEADING = re.compile(r"^(#{1,6})\s+(.+?)\s*#*$")
CODE_SPAN = re.compile(r"(`+)(?!`).*?(?<!`)\1(?!`)")
# [text](target) and ![text](target "title"); the text may hold an image or code in brackets.
LINK = re.compile(
    r"\[(?:[^\[\]]|\[[^\[\]]*\])*\]\(\s*<?([^\s()<>]*(?:\([^\s()]*\)[^\s()<>]*)*)>?[^()]*\)"
)


@dataclass(frozen=True)
class Block:
    """Fenced code block."""

    language: str
    words: str  # what follows the language on the opening fence
    text: str
    line: int  # of the opening fence, from 1
    section: str  # the heading of level 2 above it, or ""


@dataclass(frozen=True)
class Link:
    target: str
    line: int


class PageError(Exception):
    """Fault of a page, with its line."""


class Page:
    """Markdown file."""

    def __init__(self, path: Path):
        self.path = path
        self.blocks: list[Block] = []
        self.links: list[Link] = []
        self.headings: list[str] = []
        self.prose: list[str] = []  # all lines, blank where there is code
        self._read(path.read_text(encoding="utf-8").splitlines())

    @property
    def anchors(self) -> set[str]:
        """Anchors of the headings, as GitHub forms them."""
        found: set[str] = set()
        for heading in self.headings:
            name = base = anchor_of(heading)
            count = 0
            while name in found:
                count += 1
                name = f"{base}-{count}"
            found.add(name)
        return found

    def _read(self, lines: list[str]) -> None:
        section = ""
        number = 0
        while number < len(lines):
            line = lines[number]
            if fence := FENCE.match(line):
                end = self._end_of(fence[1], lines, number)
                language, _, words = fence[2].strip().partition(" ")
                text = "\n".join(lines[number + 1 : end]) + "\n"
                self.blocks.append(Block(language, words.strip(), text, number + 1, section))
                self.prose += [""] * (end + 1 - number)
                number = end + 1
                continue
            if heading := HEADING.match(line):
                self.headings.append(heading[2])
                section = heading[2] if len(heading[1]) == 2 else section
            self.prose.append("" if line.startswith("    ") else line)
            number += 1
        self._find_links("\n".join(self.prose))

    def _end_of(self, fence: str, lines: list[str], begin: int) -> int:
        for number in range(begin + 1, len(lines)):
            if lines[number].rstrip() == fence:
                return number
        raise PageError(f"{self.path}:{begin + 1}: this block is not closed")

    def _find_links(self, prose: str) -> None:
        plain = CODE_SPAN.sub(lambda code: "x" * len(code[0]), prose)
        for link in LINK.finditer(plain):
            line = plain.count("\n", 0, link.start()) + 1
            self.links.append(Link(link[1], line))


def anchor_of(heading: str) -> str:
    """Returns GitHub's anchor of a heading: lower case, no punctuation, dashes for spaces."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    return re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")


def known_files() -> list[Path]:
    """Files that git tracks or would add; without git, an approximation."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        return files_below(ROOT)
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode != 0:  # another user's checkout, say
        return files_below(ROOT)
    return sorted({ROOT / name for name in listed.stdout.split("\0") if (ROOT / name).is_file()})


def files_below(root: Path) -> list[Path]:
    """All files except built, generated and hidden ones, but including those of CI and settings."""
    found = [path for path in root.iterdir() if path.is_file()]
    for folder, folders, names in os.walk(root):
        path = Path(folder)
        if path == root:
            folders[:] = [each for each in folders if each not in ("build", "out")]
        else:
            found += [path / name for name in names]
        folders[:] = [
            each
            for each in folders
            if (each == ".ci" or not each.startswith("."))
            and each != "__pycache__"
            and not each.endswith(".groundray")
        ]
    return sorted(found)


FILES = known_files()
PAGES = [path for path in FILES if path.suffix == ".md"]


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))
