"""Finds names that two sources of a folder both define in anonymous namespaces.

    unique_names.py SOURCE...

Sources of a folder compile together, several as one (core/cmake/compile.cmake). Two definitions of
one name are an error then, but two overloads are not: a call could silently find the other
source's function. Expects sources formatted by clang-format, where lines that start in the first
column are at namespace scope. Operators, and names that headers declare, are not compared.
"""

import collections
import os
import re
import sys
from pathlib import Path

OPEN = re.compile(r"(?:inline )?namespace ?([\w:]*) ?\{")
ALIAS = re.compile(r"(?:namespace|using) (\w+) =.*")
DEFINITIONS = (
    ALIAS,
    re.compile(r"(?:struct|class|union|enum class|enum) (\w+)"),
    re.compile(r"(?:static |thread_local )?const(?:expr|init)?\b[^(={]*?\b(\w+) *[={;[]"),
    re.compile(r"(?!using |namespace |template|TEST|BENCHMARK|[A-Z_]+\()[^=]*?((?:\w+::)*\w+)\("),
)


def private_names(text: str) -> dict[str, tuple[int, str]]:
    """Returns line and text of each definition in an anonymous namespace, by its qualified name."""
    text = re.sub(r'R"\(.*?\)"', lambda raw: "\n" * raw[0].count("\n"), text, flags=re.DOTALL)
    names = {}
    spaces: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        if opened := OPEN.match(line):
            spaces.append(opened[1])
        elif line.startswith("}  // namespace"):
            spaces.pop()
        elif "" in spaces and re.match(r"[A-Za-z\[]", line):
            line = re.sub(r"^\[\[\w+\]\] |<[^<>]*>", "", line)
            found = next(filter(None, (form.match(line) for form in DEFINITIONS)), None)
            if found:
                names["::".join(filter(None, [*spaces, found[1]]))] = (number, line)
    return names


def main() -> int:
    places = collections.defaultdict(dict)
    for source in sys.argv[1:]:
        for name, place in private_names(Path(source).read_text()).items():
            places[os.path.dirname(source), name][source] = place
    count = 0
    for (_, name), found in places.items():
        same_alias = len({line for _, line in found.values()}) == 1 and all(
            ALIAS.match(line) for _, line in found.values()
        )
        if len(found) > 1 and not same_alias:
            where = ", ".join(f"{source}:{number}" for source, (number, _) in found.items())
            print(f"{name} is defined in {where}: sources of a folder compile as one")
            count += 1
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
