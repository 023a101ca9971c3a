"""Another renderer sees what groundray's path tracer sees: Mitsuba 3, of the same mesh and light.

Mitsuba's wheel is large and not among test/requirements.txt: without it this is skipped.
"""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARK = Path(__file__).resolve().parents[1] / "benchmark"


@pytest.fixture(scope="module")
def peers() -> ModuleType:
    pytest.importorskip(
        "mitsuba",
        reason="mitsuba is not installed: pip install -r test/benchmark/camera_peers.txt",
    )
    sys.path.insert(0, str(BENCHMARK))
    return importlib.import_module("camera_peers")


def test_mitsuba_sees_the_same_light(peers: ModuleType, tmp_path: Path) -> None:
    agreement = peers.check(peers.mitsuba("scalar_rgb"), tmp_path)
    assert agreement.holds(), agreement
