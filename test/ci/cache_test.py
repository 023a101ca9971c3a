"""Checks the caches of builds and of clang-tidy: clones share all, a changed header ends exactly
what includes it. A hit for what has changed would let a broken change pass."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from markdown_page import known_files

ROOT = Path(__file__).resolve().parents[2]
COMPILERS = [
    pytest.param(
        name, marks=pytest.mark.skipif(not shutil.which(name), reason=f"there is no {name}")
    )
    for name in ("g++", "clang++-16")
]


def load_clang_tidy():
    spec = importlib.util.spec_from_file_location("clang_tidy", ROOT / ".ci/clang_tidy.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


clang_tidy = load_clang_tidy()

# Five sources in two folders: each folder compiles as one file, and main.cpp alone.
PROJECT = {
    "CMakeLists.txt": """
        cmake_minimum_required(VERSION 3.25)
        project(groundray LANGUAGES CXX)
        find_package(fmt REQUIRED)
        find_package(glm REQUIRED)
        include(compile.cmake)
        add_library(shapes circle/area.cpp circle/edge.cpp square/area.cpp square/edge.cpp)
        target_compile_features(shapes PRIVATE cxx_std_20)
        target_compile_options(shapes PRIVATE -ffp-contract=off)
        target_link_libraries(shapes PRIVATE fmt::fmt)
        groundray_compile(shapes)
        add_executable(program main.cpp)
        target_compile_features(program PRIVATE cxx_std_20)
        target_compile_options(program PRIVATE -ffp-contract=off)
        target_link_libraries(program PRIVATE shapes fmt::fmt)
        groundray_compile(program)
        """,
    "circle/pi.h": "#pragma once\nconstexpr double pi = 3.14;",
    "circle/circle.h": '#pragma once\n#include "circle/pi.h"\n'
    "namespace circle { double area(); double edge(); }",
    "circle/area.cpp": '#include "circle/circle.h"\ndouble circle::area() { return pi; }',
    "circle/edge.cpp": '#include "circle/circle.h"\ndouble circle::edge() { return 2 * pi; }',
    "square/square.h": "#pragma once\nnamespace square { double area(); double edge(); }",
    "square/area.cpp": '#include "square/square.h"\ndouble square::area() { return 1; }',
    "square/edge.cpp": '#include "square/square.h"\ndouble square::edge() { return 4; }',
    "main.cpp": '#include "circle/circle.h"\n#include "square/square.h"\n'
    "int main() { return int(100 * (circle::area() - square::area())); }",
}


def make_project(folder: Path) -> None:
    for name, text in PROJECT.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(re.sub(r"^ {8}", "", text, flags=re.MULTILINE) + "\n")
    text = (ROOT / "core/cmake/compile.cmake").read_text()
    (folder / "compile.cmake").write_text(
        text + "target_include_directories(groundray_build_flags INTERFACE ${PROJECT_SOURCE_DIR})\n"
    )


class Builder:
    """Builds projects with a separate cache."""

    def __init__(self, folder: Path, compiler: str):
        self.compiler = compiler
        self.log = folder / "ccache.log"
        self.environment = os.environ | {
            "CCACHE_DIR": str(folder / "cache"),
            "CCACHE_STATSLOG": str(self.log),
        }

    def build(self, project: Path) -> dict[str, bool]:
        """Builds a project and returns for each object that was compiled whether it was cached."""
        settings = [f"-DCMAKE_CXX_COMPILER={self.compiler}", "-DCMAKE_BUILD_TYPE=Release"]
        configure = ["cmake", "-G", "Ninja", "-S", project, "-B", project / "build", *settings]
        for command in (configure, ["cmake", "--build", project / "build"]):
            self.log.unlink(missing_ok=True)
            done = subprocess.run(command, env=self.environment, capture_output=True, text=True)
            assert done.returncode == 0, done.stdout + done.stderr
        cached = {}
        log = self.log.read_text() if self.log.exists() else ""  # absent if nothing was compiled
        for entry in re.split(r"^# ", log, flags=re.MULTILINE)[1:]:
            source, *events = entry.split()
            cached[Path(source).name] = "cache_miss" not in events
        return cached

    def program(self, project: Path) -> int:
        return subprocess.run([project / "build/program"]).returncode


@pytest.fixture(scope="module", params=COMPILERS)
def first_build(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    builder = Builder(folder, request.param)
    make_project(folder / "first")
    cached = builder.build(folder / "first")
    # Two folders, the program, and for g++ the precompiled header with its empty source.
    assert {"1_circle.cpp", "1_square.cpp", "main.cpp"} <= set(cached)
    assert not any(cached.values())
    return folder, builder


def test_clone_in_another_folder_compiles_nothing(first_build):
    folder, builder = first_build
    clone = folder / "elsewhere" / "second"
    make_project(clone)
    cached = builder.build(clone)
    assert len(cached) >= 4
    assert all(cached.values()), cached
    assert builder.program(clone) == 214


def test_changed_header_recompiles_exactly_what_includes_it(first_build):
    folder, builder = first_build
    clone = folder / "changed"
    make_project(clone)
    (clone / "circle/pi.h").write_text("#pragma once\nconstexpr double pi = 3.1416;\n")
    cached = builder.build(clone)
    compiled = {name for name, hit in cached.items() if not hit}
    assert compiled == {"1_circle.cpp", "main.cpp"}
    # In place, where ninja decides first, likewise.
    (clone / "square/square.h").write_text(
        PROJECT["square/square.h"] + "\nconstexpr int sides = 4;\n"
    )
    compiled = {name for name, hit in builder.build(clone).items() if not hit}
    assert compiled == {"1_square.cpp", "main.cpp"}


def test_changed_precompiled_header_is_shared_between_clones(first_build):
    folder, builder = first_build
    first = (folder / "first/compile.cmake").read_text()
    changed = first.replace("<algorithm> <array>", "<algorithm> <array> <atomic>")
    assert changed != first
    (folder / "first/compile.cmake").write_text(changed)
    builder.build(folder / "first")
    clone = folder / "later"
    make_project(clone)
    (clone / "compile.cmake").write_text(changed)
    cached = builder.build(clone)
    assert len(cached) >= 3
    assert all(cached.values()), cached


@pytest.fixture(scope="module")
def tree():
    return clang_tidy.SourceTree(ROOT)


# g++ -MM is the oracle: the headers that the preprocessor really opens.
@pytest.mark.parametrize(
    "source",
    [
        "core/tracing/ray_tracer.cpp",
        "sensors/sky/sky.cpp",
        "terrain/lod/clipmap.cpp",
        "reconstruction/mesh/merge/mesh_merge.cpp",
        "apps/groundray/generate.cpp",
        "test/core/geometry/pose_test.cpp",
    ],
)
def test_stamp_covers_every_header_that_the_compiler_opens(tree, source):
    command = clang_tidy_command(source)
    made = subprocess.run(
        [*command, "-MM", "-MT", "target"], capture_output=True, text=True, check=True
    ).stdout
    opened = {os.path.relpath(name, ROOT) for name in made.replace("\\\n", " ").split()[1:]}
    opened = {name for name in opened if not name.startswith("..")}
    listed = set(tree.dependencies([source]))
    assert opened <= listed
    # The compiler skips what conditions exclude, which is rare.
    assert len(listed - opened) <= 2, listed - opened


def clang_tidy_command(source: str) -> list[str]:
    embree = 4 if Path("/usr/include/embree4").exists() else 3
    flags = ["-std=c++20", f"-I{ROOT}", f"-I{ROOT / 'data'}", f"-DGROUNDRAY_EMBREE={embree}"]
    packages = ["OpenEXR", "Imath", "gdal", "opencv4", "eigen3"]
    return [
        "g++",
        *flags,
        *(f"-isystem/usr/include/{name}" for name in packages),
        str(ROOT / source),
    ]


def test_changed_header_invalidates_exactly_the_stamps_of_its_includers(tree, tmp_path):
    folder = tmp_path / "clone"
    files = [path for path in known_files() if path.suffix in (".cpp", ".h", ".hip", ".inc")]
    names = [str(path.relative_to(ROOT)) for path in files]
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    sources = [name for name in names if name.endswith(".cpp")]
    before = {name: tree.stamp([name], "settings") for name in sources}
    assert {
        name: clang_tidy.SourceTree(folder).stamp([name], "settings") for name in sources
    } == before
    changed = "sensors/lidar/receiver/waveform.h"
    with (folder / changed).open("a") as header:
        header.write("// changed\n")
    copy = clang_tidy.SourceTree(folder)
    ended = {name for name in sources if copy.stamp([name], "settings") != before[name]}
    # Found by following includes from the header outwards, where the stamps follow them inwards.
    reached = {changed}
    texts = {name: (ROOT / name).read_text() for name in names}
    while True:
        more = {
            name
            for name, text in texts.items()
            if name not in reached and any(f'"{header}"' in text for header in reached)
        }
        if not more:
            break
        reached |= more
    assert ended == reached & set(sources)
    assert 5 < len(ended) < len(sources) // 2
    assert len({tree.stamp([sources[0]], settings) for settings in ("a", "b")}) == 2


def test_only_passing_sources_leave_a_stamp(tmp_path, monkeypatch):
    for name, text in {"good.cpp": "int one() { return 1; }\n", "bad.cpp": "bad\n"}.items():
        (tmp_path / name).write_text(text)
    (tmp_path / ".clang-tidy").write_text("Checks: '-*'\n")
    (tmp_path / "test").mkdir()
    (tmp_path / "test/requirements.txt").write_text("\n")
    (tmp_path / "build").mkdir()
    flags = [["-Dgood"], ["-Dbad"]]  # different ones, so that each is read by itself
    commands = [
        {"file": str(tmp_path / f"{word[0][2:]}.cpp"), "command": f"c++ {word[0]}"}
        for word in flags
    ]
    (tmp_path / "build/compile_commands.json").write_text(json.dumps(commands))
    ran = tmp_path / "ran"
    checker = tmp_path / "checker"  # stands in for clang-tidy: a text with "bad" fails
    checker.write_text(
        f'#!/bin/sh\n[ "$1" = --version ] && exit\necho "$2" >>{ran}\n! grep -q bad "$2"\n'
    )
    checker.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    arguments = ["clang_tidy.py", "build", str(checker), "good.cpp", "bad.cpp"]
    monkeypatch.setattr("sys.argv", arguments)
    assert clang_tidy.main() == 1
    assert sorted(ran.read_text().split()) == ["bad.cpp", "good.cpp"]
    ran.unlink()
    assert clang_tidy.main() == 1
    assert ran.read_text().split() == ["bad.cpp"]
    (tmp_path / "bad.cpp").write_text("int two() { return 2; }\n")
    assert clang_tidy.main() == 0
    ran.unlink()
    assert clang_tidy.main() == 0
    assert not ran.exists()
    # What is mended while it is checked has not passed as it was before.
    checker.write_text(f'#!/bin/sh\n[ "$1" = --version ] || echo mended >{tmp_path}/good.cpp\n')
    (tmp_path / "good.cpp").write_text("bad\n")
    assert clang_tidy.main() == 0
    checker.write_text('#!/bin/sh\n[ "$1" = --version ]\n')
    (tmp_path / "good.cpp").write_text("bad\n")
    assert clang_tidy.main() == 1


# Two sources of a folder, one of another: what is wrong in a group is found in each source by
# itself, and a group that passes is not read again. With the clang-tidy that lint uses.
def test_groups_are_read_as_one_and_their_findings_are_those_of_each_source(tmp_path, monkeypatch):
    checker = ROOT / ".venv/bin/clang-tidy"
    if not checker.exists():
        pytest.skip(f"there is no {checker}")
    sources = ["a/one.cpp", "a/two.cpp", "b/three.cpp"]
    for name in sources:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("int good() { return 1; }\n".replace("good", name[2:-4]))
    (tmp_path / ".clang-tidy").write_text(
        "Checks: '-*,modernize-use-nullptr'\nWarningsAsErrors: '*'\nHeaderFilterRegex: '/[ab]/'\n"
    )
    (tmp_path / "test").mkdir()
    (tmp_path / "test/requirements.txt").write_text("\n")
    (tmp_path / "build").mkdir()
    commands = [
        {
            "file": str(tmp_path / name),
            "directory": str(tmp_path / "build"),
            "command": f"c++ -std=c++20 -I{tmp_path} -o {name}.o -c {tmp_path / name}",
        }
        for name in sources
    ]
    (tmp_path / "build/compile_commands.json").write_text(json.dumps(commands))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("sys.argv", ["clang_tidy.py", "build", str(checker), *sources])
    read = []
    findings = clang_tidy.findings
    monkeypatch.setattr(
        clang_tidy, "findings", lambda *command: read.append(command) or findings(*command)
    )
    assert clang_tidy.main() == 0
    assert len(read) == 2
    assert clang_tidy.main() == 0
    assert len(read) == 2
    (tmp_path / "a/two.cpp").write_text("int* two() { return 0; }\n")
    assert clang_tidy.main() == 1
    assert len(read) == 5  # the group, then both of its sources
    (tmp_path / "a/two.cpp").write_text("int* two() { return nullptr; }\n")
    assert clang_tidy.main() == 0
    assert len(read) == 6
    # Two of one name do not compile together, but each does alone.
    (tmp_path / "a/two.cpp").write_text("int one() { return 2; }\n")
    assert clang_tidy.main() == 0
    assert len(read) == 9
