"""Measures what is wanted of the speed and writes the first table of docs/speed.md.

Prints each figure and its ratio to what is wanted. Run by `./dev bench wanted`; takes some ten
minutes.

Each figure is a ratio of one run, or CPU seconds of a whole run. A row whose peer is not installed
is printed as not measured, and the table is then left as it is.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import camera_peers

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/release/bin"
PAGE = ROOT / "docs/speed.md"
BEGIN = "<!-- What follows is by test/benchmark/speed_table.py, of the last run. -->\n"
END = "<!-- What follows is by hand. -->\n"
TRAIL_CAMERA = """\
cameras:
  - name: front
    preset: realsense_d455_color
    rate_hz: 1
    first_ms: 500
    mount: {translation_m: [1.5, 0, 1.3], pitch_deg: 5}
    sampling: {samples: 8, most_samples: 8, depth: 3}
    products: [radiance, picture]
"""


@dataclass
class Row:
    what: str
    how: str
    measured: float
    wanted: float
    unit: str = "x"
    most: bool = False  # whether `wanted` is the most, not the least

    def ratio(self) -> float:
        """Returns how much of what is wanted is reached; 1 or more if all of it is."""
        return self.wanted / self.measured if self.most else self.measured / self.wanted


class NotMeasuredError(Exception):
    """A peer is missing, with the remedy."""


def counters(benchmark: str) -> dict:
    """Runs one benchmark of groundray_bench and returns its counters."""
    command = [BUILD / "groundray_bench", f"--benchmark_filter=^{benchmark}(/|$)"]
    run = subprocess.run(
        [*map(str, command), "--benchmark_format=json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        check=True,
    )
    found = json.loads(run.stdout)["benchmarks"]
    if len(found) != 1 or found[0].get("error_occurred") or "skipped" in found[0]:
        message = found[0].get("error_message") if found else "there is no such benchmark"
        raise NotMeasuredError(f"{benchmark}: {message}")
    return found[0]


def of_counter(what: str, benchmark: str, counter: str, wanted: float, **unit) -> Iterator[Row]:
    yield Row(what, f"`{benchmark}`", counters(benchmark)[counter], wanted, **unit)


def of_mitsuba() -> Iterator[Row]:
    for variant, wanted in (("llvm_ad_rgb", 1.2), ("scalar_rgb", 1.51)):
        run = subprocess.run(
            [sys.executable, camera_peers.__file__, variant], stdout=subprocess.PIPE, text=True
        )
        if run.returncode != 0:
            raise NotMeasuredError(f"Mitsuba {variant} does not run: llvm_ad_rgb needs libllvm19")
        rate = json.loads(run.stdout)
        yield Row(
            f"camera light against Mitsuba's `{variant}`, 1280 x 960, depth 3",
            "`./dev bench camera`",
            rate["groundray"] / rate["mitsuba"],
            wanted,
        )


def of_open3d() -> Iterator[Row]:
    try:
        import open3d_baseline
        import open3d_rays
    except ImportError as missing:
        raise NotMeasuredError(f"{missing}: ./dev bench open3d installs and builds it") from None
    scans = open3d_baseline.ratios()
    yield Row(
        "the same scan against the rays alone in Open3D's RaycastingScene",
        "`./dev bench open3d`",
        sum(scans) / len(scans),
        2.3,
    )
    for name, rates in open3d_rays.rates():
        yield Row(
            f"`cast_rays` from Python, fast, {name}: 10⁶ rays over 400², against Open3D",
            "`./dev bench open3d`",
            rates["fast"] / rates["Open3D"],
            1.5,
        )


def cpu_s_of(scene: Path, folder: Path) -> float:
    """Returns the CPU time of `groundray generate` and all its threads."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [BUILD / "groundray", "generate", scene, "-o", folder, "--quiet"]
    subprocess.run(list(map(str, command)), check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def of_trail() -> Iterator[Row]:
    demo = ROOT / "data/scenes/offroad_trail.yaml"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        spent_s = cpu_s_of(demo, folder / "demo")
        yield Row(
            "the demo, all of offroad_trail", "`groundray generate`", spent_s, 17, "CPU-s", True
        )
        picture = folder / "picture.yaml"
        text = demo.read_text().split("lidars:")[0].replace(": ../", f": {ROOT}/data/")
        picture.write_text(text + TRAIL_CAMERA)
        spent_s = cpu_s_of(picture, folder / "picture")
        what = "a picture of the trail, 848 x 480, 8 samples, depth 3"
        yield Row(what, "`groundray generate`", spent_s, 20, "CPU-s", True)


ROWS: list[Callable[[], Iterator[Row]]] = [
    of_mitsuba,
    lambda: of_counter(
        "16 sub-rays a pulse, waveform, noise, of raw Embree", "lidar_light/driven", "of_raw", 0.5
    ),
    lambda: of_counter(
        "one ray a pulse, driven, of raw Embree", "lidar_one_ray/driven", "of_raw", 0.6
    ),
    lambda: of_counter(
        "one ray a pulse, flown, of raw Embree", "lidar_one_ray/flown", "of_raw", 0.6
    ),
    lambda: of_counter(
        "a VLS-128, all columns, of raw Embree", "scan_vls128/typical", "of_raw", 0.65
    ),
    of_open3d,
    lambda: of_counter(
        "rays among grass, of those over bare ground", "objects_among/grass", "of_bare", 0.32
    ),
    lambda: of_counter("rays among shrubs, likewise", "objects_among/shrubs", "of_bare", 0.32),
    lambda: of_counter("rays among conifers, likewise", "objects_among/conifers", "of_bare", 0.32),
    lambda: of_counter("truth of an image, of raw Embree", "camera_truth/driven", "of_raw", 0.6),
    lambda: of_counter("`exact` tracing, of `fast`", "exact_against_fast", "of_fast", 0.45),
    of_trail,
    lambda: of_counter(
        "a step of the clipmap over the Moon",
        "terrain_step_moon",
        "median_ms",
        6,
        unit="ms",
        most=True,
    ),
]


def table(rows: list[Row]) -> str:
    lines = ["| what | measured by | measured | wanted | reached |", "|---|---|---|---|---|"]
    for row in rows:
        sign = "≤" if row.most else "≥"
        lines.append(
            f"| {row.what} | {row.how} | {row.measured:.2f} {row.unit} | {sign} {row.wanted:g} "
            f"{row.unit} | {100 * row.ratio():.0f} % |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    rows, is_complete = [], True
    for measure in ROWS:
        try:
            for row in measure():
                rows.append(row)
                print(
                    f"{row.what:70} {row.measured:8.2f} {row.unit:5} of {row.wanted:g}: "
                    f"{100 * row.ratio():.0f} %",
                    flush=True,
                )
        except NotMeasuredError as missing:
            is_complete = False
            print(f"not measured: {missing}", file=sys.stderr)
    if not is_complete:
        sys.exit(f"{PAGE.relative_to(ROOT)} is unchanged, since not all rows were measured")
    before, rest = PAGE.read_text().split(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n{table(rows)}\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    os.environ.setdefault("GROUNDRAY_SHARED_DATA", str(ROOT.parent / "shared/data"))
    main()
