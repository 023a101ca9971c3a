"""Pages of docs refer to existing links, anchors, pictures, files and pages."""

import re
from pathlib import Path

import pytest
from markdown_page import FILES, PAGES, ROOT, Page, PageError, anchor_of, files_below, name_of

FOLDERS = "core|terrain|sensors|reconstruction|apps|test|docs|data"
# A file of ours as text names it; names with * or <...> stand for several.
NAMED_FILE = re.compile(
    rf"(?<![\w./-])(?:{FOLDERS})/[\w./-]*\.(?:h|cpp|py|md|yaml|png|tif|txt|cmake)\b"
)
# How words are spelt here, where prose could have them otherwise.
SPELT = {
    "CloudCompare": r"Cloud ?[Cc]ompare",
    "centre": r"\b[Cc]ent(?:re|er)s?\b",
    "colour": r"[Cc]olou?r(?!Checker|-science)",
    "Embree": r"[Ee]mbree",
    "GeoTIFF": r"[Gg]eo-?[Tt][Ii][Ff][Ff]",
    "grey": r"\b[Gg]r[ea]y\b",
    "groundray": r"\b[Gg]round-?[Rr]ay\b",
    "lidar": r"\b[Ll][Ii][Dd][Aa][Rr]s?\b",
    "metre": r"\b[Mm]et(?:re|er)s?\b",
    "NumPy": r"\b[Nn]um[Pp]y\b",
    "OpenCV": r"\b[Oo]pen-?[Cc][Vv]\b",
    "OpenEXR": r"\b[Oo]pen-?[Ee][Xx][Rr]\b",
}


def test_without_git_the_same_files_are_found(tmp_path: Path) -> None:
    """Built, generated and hidden files are excluded; the result matches git's in the checkout."""
    ours = [
        "README.md",
        ".gitignore",
        ".ci/run",
        "docs/guide/guide.md",
        "apps/build/a",
        "test/out/b",
    ]
    others = [
        "build/docs/a",
        "out/run/a.md",
        ".venv/a.md",
        ".git/config",
        "test/.cache/a",
    ]
    others += ["apps/__pycache__/a", "data/a.groundray/b"]
    for name in (*ours, *others):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("text")
    assert files_below(tmp_path) == sorted(tmp_path / name for name in ours)
    missing = set(PAGES) - set(files_below(ROOT))
    assert missing == set()


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_links_lead_to_files_and_headings(path: Path) -> None:
    broken = []
    for link in Page(path).links:
        if re.match(r"[a-z]+:", link.target):
            continue
        target, _, anchor = link.target.partition("#")
        file = (path.parent / target).resolve() if target else path
        if file not in FILES:
            broken.append(f"{name_of(path)}:{link.line}: there is no file {link.target}")
        elif anchor and anchor not in Page(file).anchors:
            broken.append(f"{name_of(path)}:{link.line}: no heading gives {link.target}")
    assert not broken, "\n".join(broken)


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_files_named_on_pages_exist(path: Path) -> None:
    missing = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        for name in NAMED_FILE.findall(line):
            if ROOT / name not in FILES and path.parent / name not in FILES:
                missing.append(f"{name_of(path)}:{number}: there is no file {name}")
    assert not missing, "\n".join(missing)


def test_pages_named_in_sources_exist() -> None:
    missing = []
    for path in FILES:
        if path.suffix not in (".h", ".cpp", ".py", ".cmake", ".yaml", ".txt"):
            continue
        for name in re.findall(
            r"\bdocs/[\w/]+\.md\b", path.read_text(encoding="utf-8", errors="ignore")
        ):
            if ROOT / name not in FILES:
                missing.append(f"{name_of(path)}: there is no page {name}")
    assert not missing, "\n".join(missing)


def test_every_page_is_in_the_list_of_pages() -> None:
    index = ROOT / "docs/README.md"
    listed = {(index.parent / link.target).resolve() for link in Page(index).links}
    below = {path for path in PAGES if path.is_relative_to(ROOT / "docs")}
    missing = {path for path in below if path.parent.name != "accuracy"} - listed - {index}
    assert not missing, sorted(map(name_of, missing))


def test_every_picture_is_shown_on_a_page() -> None:
    shown = {(path.parent / link.target).resolve() for path in PAGES for link in Page(path).links}
    idle = [
        p
        for p in FILES
        if p.suffix == ".png" and p.is_relative_to(ROOT / "docs") and p not in shown
    ]
    assert not idle, list(map(name_of, idle))


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_names_are_spelt_consistently(path: Path) -> None:
    """Only in prose: code, links and titles of papers are exempt."""
    wrong = []
    for number, line in enumerate(Page(path).prose, 1):
        if line == "## References":
            break
        text = re.sub(r"`[^`]*`|\*[^*]+\*|\]\([^)]*\)|https?://\S+", "", line)
        for right, pattern in SPELT.items():
            for found in re.findall(pattern, text):
                if not is_spelt(found, right):
                    wrong.append(f"{name_of(path)}:{number}: {found} is spelt {right}")
    assert not wrong, "\n".join(wrong)


def is_spelt(found: str, right: str) -> bool:
    """A common word may begin a sentence."""
    plain = found.rstrip("s")
    common = right.islower() and right != "groundray"
    return plain == right or (common and plain == right.capitalize())


def test_anchors_are_named_as_git_forges_do() -> None:
    assert (
        anchor_of("What it does, and what it does not yet")
        == "what-it-does-and-what-it-does-not-yet"
    )
    assert anchor_of("`groundray terrain` & co.") == "groundray-terrain--co"


def test_links_and_blocks_are_distinguished_from_code(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(
        "# A page\n\nSee [one](one.md#part), ![a [b]](two.png) and `[no](three.md)`.\n\n"
        "    [no](four.md)\n\n## Part\n\n````yaml scene.yaml\nkey: [1](2)\n```\n````\n## Part\n"
    )
    page = Page(tmp_path / "page.md")
    assert [link.target for link in page.links] == ["one.md#part", "two.png"]
    assert [link.line for link in page.links] == [3, 3]
    assert page.anchors == {"a-page", "part", "part-1"}
    (block,) = page.blocks
    assert (block.language, block.words, block.section) == ("yaml", "scene.yaml", "Part")
    assert block.text == "key: [1](2)\n```\n"


def test_an_unclosed_block_is_reported(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("text\n```sh\nls\n")
    with pytest.raises(PageError, match=r"page\.md:2: this block is not closed"):
        Page(tmp_path / "page.md")
