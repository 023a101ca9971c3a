"""Completions of shells and manual pages, as the programs print them."""

import os
import pty
import re
import select
import shutil
import subprocess
import time

import pytest
from dataset_runs import ROOT

BIN = ROOT / "build/release/bin"
PROGRAMS = [
    "groundray",
    "groundray-golden",
    "groundray-view",
    "groundray-export",
    "groundray-index",
    "groundray-cluster",
]
COMMANDS = {
    "groundray": [
        *("generate", "sample", "verify", "merge", "info", "list", "terrain", "reconstruct"),
        *("traversability", "voxels"),
        *(f"terrain {what}" for what in ("mesh", "certify", "fill")),
        *(f"reconstruct {what}" for what in ("mesh", "simplify", "fill", "dem")),
    ],
    "groundray-golden": ["run", "accept", "compare", "passes", "conform"],
    "groundray-cluster": ["run", "sweep", "shard", "merge", "status", "verify"],
}


def printed(program, *arguments):
    result = subprocess.run(
        [BIN / program, *arguments], capture_output=True, text=True, timeout=120, check=False
    )
    assert result.returncode == 0, result.stderr
    assert not result.stderr
    return result.stdout


def options_of(program, command):
    text = printed(program, *command.split(), "--help")
    return set(re.findall(r"^(?:  ){1,4}(?:-\w(?: \w+)?, ?)?(--[a-z][\w-]*)", text, re.MULTILINE))


def completed(program, line, folder):
    """Returns what bash offers for the last word of a command line."""
    (folder / "script").write_text(printed(program, "--completion", "bash"))
    words = line.split(" ")
    call = f"""
source {folder / "script"}
COMP_WORDS=({" ".join(f"'{word}'" for word in words)})
COMP_CWORD={len(words) - 1}
"$(complete -p {program} | sed 's/.*-F \\([^ ]*\\).*/\\1/')" {program}
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    (folder / "home").mkdir(exist_ok=True)
    (folder / "home/scene.yaml").write_text("")
    result = subprocess.run(
        ["bash", "--norc", "-c", call],
        cwd=folder / "home",
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert not result.stderr
    return set(result.stdout.split())


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "groundray ",
            {
                *("generate", "sample", "verify", "merge", "info", "list", "terrain"),
                *("traversability", "voxels", "reconstruct"),
            },
        ),
        ("groundray ge", {"generate"}),
        ("groundray terrain ", {"mesh", "certify", "fill"}),
        ("groundray generate --se", {"--seed", "--sensor"}),
        ("groundray generate --frames ", set()),
        ("groundray generate --seed=", set()),
        ("groundray generate -o ", {"scene.yaml"}),
        ("groundray generate ", {"scene.yaml"}),
        ("groundray list ", {"presets", "lidars", "cameras", "materials", "assets"}),
        ("groundray --completion ", {"bash", "zsh"}),
        ("groundray info velodyne_vl", {"velodyne_vlp16", "velodyne_vlp32c", "velodyne_vls128"}),
        ("groundray info sc", {"scene.yaml"}),
        ("groundray reconstruct mesh scene.yaml --returns ", {"last", "strongest", "first"}),
        ("groundray reconstruct mesh scene.yaml --returns = s", {"strongest"}),
        ("groundray-golden compare --png la", {"label"}),
        ("groundray-view --no", {"--no-legend"}),
        ("groundray-view --point-size ", set()),
        ("groundray-export --to sem", {"semantic-kitti"}),
        ("groundray-export --la", {"--labels"}),
        ("groundray-export sc", {"scene.yaml"}),
        ("groundray-export --columns ", set()),
        ("groundray-index --sp", {"--split"}),
        ("groundray-index sc", {"scene.yaml"}),
        ("groundray-index --split ", set()),
        ("groundray-cluster s", {"sweep", "shard", "status"}),
        ("groundray-cluster --completion z", {"zsh"}),
        ("groundray-cluster run --sh", {"--shards"}),
        ("groundray-cluster run sc", {"scene.yaml"}),
        ("groundray-cluster run --scratch ", {"scene.yaml"}),
        ("groundray-cluster run --retries ", set()),
        ("groundray-cluster status ", set()),
    ],
)
def test_bash_completes(tmp_path, line, words):
    assert completed(line.split()[0], line, tmp_path) == words


@pytest.mark.parametrize("program", PROGRAMS)
def test_bash_offers_every_option_of_every_command(tmp_path, program):
    for command in ["", *COMMANDS.get(program, [])]:
        line = " ".join(filter(None, (program, command, "--")))
        offered = completed(program, line, tmp_path)
        assert offered == options_of(program, command), command


def shown_by_zsh(folder, line, words):
    """Types a line and a tab in zsh, and returns what it shows until it has shown all words."""
    controller, terminal = pty.openpty()
    shell = subprocess.Popen(
        ["zsh", "-f", "-i"],
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        cwd=folder,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "400", "LINES": "200"},
        start_new_session=True,
    )
    os.close(terminal)
    shown = ""

    def wait_for(expected, seconds=40):
        nonlocal shown
        end = time.monotonic() + seconds
        while time.monotonic() < end and not all(word in shown for word in expected):
            if select.select([controller], [], [], 0.5)[0]:
                shown += os.read(controller, 1 << 16).decode(errors="replace")

    try:
        setup = f"fpath=({folder} $fpath); autoload -Uz compinit; compinit -u -D; LISTMAX=10000"
        os.write(controller, f'{setup}; echo rea""dy\n'.encode())
        wait_for(["ready"])
        shown = ""
        os.write(controller, f"{line}\t".encode())
        wait_for(words)
    finally:
        shell.kill()
        shell.wait()
        os.close(controller)
    return shown


@pytest.mark.skipif(shutil.which("zsh") is None, reason="there is no zsh")
@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("groundray ", ["generate", "verify", "Run a scene", "reconstruct"]),
        ("groundray terrain ", ["mesh", "certify", "fill"]),
        ("groundray generate --s", ["--seed", "--sensor", "--shard", "Make the frames of"]),
        ("groundray list ", ["presets", "lidars", "cameras", "materials", "assets"]),
        ("groundray info velodyne_vl", ["velodyne_vlp16", "velodyne_vls128"]),
        ("groundray-golden compare --png ", ["kitti_depth", "label"]),
        ("groundray-view --c", ["--colour-by", "--compare-with", "--completion"]),
        ("groundray-export --to ", ["kitti", "semantic-kitti", "mcap"]),
        ("groundray-index --s", ["--split", "--seed", "--skip-pending"]),
        ("groundray-cluster s", ["sweep", "shard", "status", "Show how far a run is"]),
        ("groundray-cluster run --s", ["--shards", "--seed", "--store", "--scratch"]),
    ],
)
def test_zsh_completes(tmp_path, line, words):
    program = line.split()[0]
    (tmp_path / f"_{program}").write_text(printed(program, "--completion", "zsh"))
    shown = shown_by_zsh(tmp_path, line, words)
    for word in words:
        assert word in shown, shown


@pytest.mark.parametrize("program", PROGRAMS)
def test_manual_pages_have_every_option_and_command(program):
    page = printed(program, "--man")
    plain = page.replace("\\-", "-")
    for command in ["", *COMMANDS.get(program, [])]:
        if command:
            assert f".SS {command}\n" in plain
        start = plain.find(f".SS {command}\n") if command else 0
        end = plain.find(".SS ", start + 1)
        for option in options_of(program, command):
            assert f"{option}\\fR" in plain[start:end], (command, option)
    assert page == printed(program, "--man")


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("tool", ["groff", "mandoc"])
def test_manual_pages_are_sound(program, tool):
    if shutil.which(tool) is None:
        pytest.skip(f"there is no {tool}")
    options = {
        "groff": ["-ww", "-man", "-Tutf8", "-z"],
        "mandoc": ["-Tlint", "-W", "warning"],
    }
    result = subprocess.run(
        [tool, *options[tool]],
        input=printed(program, "--man"),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    faults = (result.stdout + result.stderr).splitlines()
    # A date would change the page without a change of the program.
    assert [fault for fault in faults if "missing date" not in fault] == []


@pytest.mark.parametrize("program", PROGRAMS)
def test_other_shells_are_wrong_usage(program):
    result = subprocess.run(
        [BIN / program, "--completion", "fish"], capture_output=True, text=True, check=False
    )
    assert result.returncode == 2
    assert "fish" in result.stderr


@pytest.mark.parametrize("program", ["groundray", "groundray-golden"])
def test_a_program_without_arguments_says_what_it_is(program):
    result = subprocess.run([BIN / program], capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert result.stdout == ""
    for command in COMMANDS[program]:
        if " " not in command:
            assert re.search(rf"^  {command} +\w", result.stderr, re.MULTILINE), command
    assert "a command is missing" in result.stderr.splitlines()[-1]
    assert len(result.stderr.splitlines()) <= 24
    if program == "groundray":
        for noun in ("simulator", "lidar", "camera", "synthetic data", "ground truth"):
            assert noun in result.stderr
