"""Results do not depend on the instruction sets of the processor."""

import os
from pathlib import Path

import exact_scenes
import pytest
from dataset_runs import PROGRAM

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
NO_AVX512 = {
    "LD_PRELOAD": str(PROGRAM.parent / "libavx2_embree.so"),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps="
    + ",".join(f"-AVX512{part}" for part in ("F", "VL", "BW", "DQ", "CD")),
    "OPENCV_CPU_DISABLE": "AVX512-SKX",
}


@pytest.mark.skipif(
    "avx512vl" not in Path("/proc/cpuinfo").read_text(),
    reason="this processor has no AVX-512, so there is nothing to compare AVX2 with",
)
def test_exact_scenes_have_the_same_bytes_without_avx512(tmp_path):
    scenes, frames = exact_scenes.scenes(), []
    if not IS_FULL:  # the forest alone takes 23 s a frame
        scenes, frames = [s for s in scenes if s.stem != "offroad_trail"], ["--frames", "0"]
    exact_scenes.make(tmp_path / "all", PROGRAM, scenes, *frames)
    reports = exact_scenes.make(tmp_path / "avx2", PROGRAM, scenes, *frames, **NO_AVX512)
    assert all("Embree without AVX-512" in report for report in reports)
    assert exact_scenes.differences(tmp_path / "all", tmp_path / "avx2") == []


def test_a_byte_that_differs_is_found(tmp_path):
    for name in ("one", "other"):
        (tmp_path / name / "datasets").mkdir(parents=True)
        (tmp_path / name / "datasets/a.bin").write_bytes(b"same" if name == "one" else b"safe!")
    (tmp_path / "one/datasets/b.bin").write_bytes(b"")
    assert exact_scenes.differences(tmp_path / "one", tmp_path / "other") == [
        "datasets/a.bin: 1 of 4 bytes differ; the other has 5",
        "datasets/b.bin: only in one of them",
    ]
