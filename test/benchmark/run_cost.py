"""Measures a run's time for writing and its memory: data/scenes/offroad_trail.yaml, prolonged.

The trail with only its VLP-16, pulses of 16 sub-rays, noise, every column and the picture of each
scan, run for 10 and for 100 frames. "writing" is the CPU time of the writing thread as a share of
the run's: the gain without it if the other threads kept all cores busy. Run by `./dev bench run`;
arguments: numbers of frames.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
LIDAR = """\
lidars:
  - name: top
    preset: velodyne_vlp16
    mount: {translation_m: [0, 0, 1.8]}
    beam: {profile: gaussian, width: inverse_e_square, divergence_mrad: [3, 1.5],
           aperture_mm: [10, 8], sub_rays: 16, most_sub_rays: 16, turn: each_pulse}
    laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}
    receiver:
      aperture_mm: 20
      efficiency: 0.6
      response_fwhm_ns: 3
      timing: constant_fraction
      returns: dual
      dead_time_ns: 10
      overlap_m: [0.5, 1]
      intensity: reflectance
      noise: {nep_w_per_sqrt_hz: 1.0e-12, quantum_efficiency: 0.8, excess_noise_factor: 3,
              false_alarm_rate_hz: 50, sun_w_m2_nm: 0.5, filter_width_nm: 20,
              field_of_view_mrad: 4}
    error_bound: report
"""


def long_trail(folder: Path, frames: int) -> Path:
    """Writes a scene of this many frames, with vehicles slowed down accordingly."""
    text = (ROOT / "data/scenes/offroad_trail.yaml").read_text().split("lidars:")[0]
    text = text.replace(": ../", f": {ROOT}/data/")
    text = text.replace("duration_s: 1", f"duration_s: {frames / 10 + 0.05}")
    speed = 40 / max(frames / 10, 5)
    text = re.sub(r"speed_m_s: 8", f"speed_m_s: {speed:.3g}", text)
    scene = folder / "scene.yaml"
    scene.write_text(text + LIDAR)
    return scene


def run(frames: int) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command = [PROGRAM, "generate", long_trail(folder, frames), "-o", folder / "out"]
        log = folder / "log.jsonl"
        process = subprocess.Popen([*command, "--log-json", log], stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        events = [json.loads(line) for line in log.read_text().splitlines()]
    done = [event for event in events if event["event"] == "frame"]
    assert len(done) == frames
    cpu_s = usage.ru_utime + usage.ru_stime
    return {
        "elapsed_s": events[-1]["elapsed_s"],
        "tracing_s": sum(event["tracing_s"] for event in done),
        "writing_s": sum(event["writing_s"] for event in done),
        "writing_share_of_cpu": sum(event["writing_cpu_s"] for event in done) / cpu_s,
        "peak_mib": usage.ru_maxrss / 1024,
    }


def main() -> None:
    frames = [int(word) for word in sys.argv[1:]] or [10, 100]
    print("frames    run s  tracing s  writing s  of CPU  peak MiB")
    for count in frames:
        took = run(count)
        print(
            f"{count:>6} {took['elapsed_s']:8.1f} {took['tracing_s']:10.1f}"
            f" {took['writing_s']:10.1f} {100 * took['writing_share_of_cpu']:6.1f}%"
            f" {took['peak_mib']:9.1f}"
        )


if __name__ == "__main__":
    main()
