"""Results do not depend on the processor or its C library."""

import os
import subprocess
import sys
from pathlib import Path

import exact_scenes
import pytest
from dataset_runs import PROGRAM

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
# Without AVX-512, and with the C library's functions for processors without FMA and AVX2.
OTHER_C_LIBRARY = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F,-AVX512VL"}
OTHER_PROCESSOR = {
    **OTHER_C_LIBRARY,
    "LD_PRELOAD": str(PROGRAM.parent / "libavx2_embree.so"),
    "OPENCV_CPU_DISABLE": "AVX512-SKX",
}


def test_exact_scenes_have_the_same_bytes_without_avx512(tmp_path):
    scenes, frames = exact_scenes.scenes(), []
    if not IS_FULL:  # these two take 23 s a frame, or more
        few = [s for s in scenes if s.stem not in ("offroad_trail", "forest_track")]
        scenes, frames = few, ["--frames", "0"]
    exact_scenes.make(tmp_path / "here", PROGRAM, scenes, *frames)
    reports = exact_scenes.make(tmp_path / "there", PROGRAM, scenes, *frames, **OTHER_PROCESSOR)
    assert all("Embree without AVX-512" in report for report in reports)
    assert exact_scenes.differences(tmp_path / "here", tmp_path / "there") == []


@pytest.mark.skipif(
    " fma " not in Path("/proc/cpuinfo").read_text(), reason="this processor has no FMA to disable"
)
def test_the_c_library_can_be_made_another():
    """Otherwise the test above would not notice a function of the C library."""
    script = "import math; print([math.exp(math.sin(k / 7) * 9).hex() for k in range(10000)])"
    command = [sys.executable, "-c", script]
    texts = [
        subprocess.run(command, env={**os.environ, **variables}, capture_output=True).stdout
        for variables in ({}, OTHER_C_LIBRARY)
    ]
    assert texts[0] != texts[1]


def test_a_byte_that_differs_is_found(tmp_path):
    for name in ("one", "other"):
        (tmp_path / name / "datasets").mkdir(parents=True)
        (tmp_path / name / "datasets/a.bin").write_bytes(b"same" if name == "one" else b"safe!")
    (tmp_path / "one/datasets/b.bin").write_bytes(b"")
    assert exact_scenes.differences(tmp_path / "one", tmp_path / "other") == [
        "datasets/a.bin: 1 of 4 bytes differ; the other has 5",
        "datasets/b.bin: only in one of them",
    ]
