"""Compares our pulses with real captures, as read by other decoders."""

import io
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY_PRINT_PULSES", ROOT / "build/release/bin/print_pulses"))
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT.parent / "shared/data")) / "lidar"

pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason=f"NO REAL CAPTURES in {SHARED}")

OUSTERS = (
    "OS-0-128-U1_v2.3.0_1024x10",
    "OS-0-32-U1_v2.2.0_1024x10",
    "OS-1-128_v2.3.0_1024x10",
    "OS-1-32-G_v2.1.1_1024x10",
    "OS-2-128-U1_v2.3.0_1024x10",
    "OS-2-32-U0_v2.0.0_1024x10",
)


def pulses(lidar, *unit):
    result = subprocess.run([PROGRAM, lidar, "0", *unit], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return np.genfromtxt(io.StringIO(result.stdout), delimiter=",", names=True)


def preset(name):
    return pulses(ROOT / f"data/sensors/{name}.yaml")


def vectors(table, *names):
    return np.column_stack([table[name].astype(float) for name in names])


def ouster_frame(name):
    """Returns the SDK's description of a sensor and the last complete frame of its capture."""
    core = pytest.importorskip("ouster.sdk.core", reason="NO DECODER: install ouster-sdk")
    sdk = pytest.importorskip("ouster.sdk")
    metadata = SHARED / f"ouster/{name}.json"
    (capture,) = (SHARED / "ouster").glob(f"{name}*.pcap")
    frames = [frame[0] for frame in sdk.open_source(str(capture), meta=[str(metadata)])]
    return core, core.SensorInfo(metadata.read_text()), frames[-1], metadata


@pytest.mark.parametrize("name", OUSTERS)
def test_ouster_beams_match_the_sdk(name):
    """Rings and columns one by one. The SDK computes in double: a few roundings, and 10 m."""
    core, info, _, metadata = ouster_frame(name)
    ours = pulses(metadata)
    rows, columns = info.format.pixels_per_column, info.format.columns_per_frame
    assert len(ours) == rows * columns
    assert (ours["ring"] == np.tile(np.arange(rows), columns)).all()
    lut = core.XYZLut(info, use_extrinsics=False)
    points_10, points_20 = (
        np.swapaxes(lut(np.full((rows, columns), mm, np.uint32)), 0, 1).reshape(-1, 3)
        for mm in (10_000, 20_000)
    )
    direction = vectors(ours, "dx", "dy", "dz")
    assert np.abs(direction - (points_20 - points_10) / 10).max() < 1e-13
    # An Ouster's range counts from the lidar's centre, not from where the beam leaves.
    offset_m = json.loads(metadata.read_text())["lidar_origin_to_beam_origin_mm"] / 1000
    reach = vectors(ours, "ox_m", "oy_m", "oz_m") + (10 - offset_m) * direction
    assert np.abs(reach - points_10).max() < 1e-12


@pytest.mark.parametrize("name", OUSTERS)
def test_ouster_columns_fire_at_the_times_of_the_capture(name):
    """Columns are triggered by the encoder of a motor that is 0.2 % off its rate and wobbles: each
    fires within half a period of ours once the motor's mean rate is taken out."""
    _, info, frame, metadata = ouster_frame(name)
    ours = pulses(metadata)["time_s"][:: info.format.pixels_per_column]
    valid = np.flatnonzero(frame.status & 1)
    assert len(valid) > 100
    theirs = (frame.timestamp[valid] - frame.timestamp[valid][0]).astype(float) * 1e-9
    slope, start = np.polyfit(ours[valid], theirs, 1)
    assert abs(slope - 1) < 0.002
    period = ours[1] - ours[0]
    assert np.abs(theirs - slope * ours[valid] - start).max() < period / 2


VELODYNES = (
    ("sample_velodyne_vlp16_gps.pcap", "VLP16", "velodyne_vlp16", 55.296e-6),
    ("sample_velodyne_hdl32.pcap", "HDL32E", "velodyne_hdl32e", 46.08e-6),
)


def velodyne_scans(file, model):
    decoder = pytest.importorskip("velodyne_decoder", reason="NO DECODER: install it")
    config = decoder.Config(model=getattr(decoder.Model, model))
    path = str(SHARED / "velodyne_pcap" / file)
    return [scan for _, scan in decoder.read_pcap(path, config, as_pcl_structs=True)]


def by_ring(ours):
    """Firing time, elevation and azimuth in the head of each ring."""
    first = ours[: len(np.unique(ours["ring"]))]
    first = first[np.argsort(first["ring"])]
    spin = -2 * np.pi * 10 * first["time_s"]  # the presets turn clockwise at 10 Hz
    azimuth = np.arctan2(first["dy"], first["dx"]) - spin
    return first["time_s"], np.arcsin(first["dz"]), azimuth


@pytest.mark.parametrize(("file", "model", "name", "period"), VELODYNES)
def test_velodyne_elevations_match_the_capture(file, model, name, period):
    """The decoder adds where its beams leave, so a ring's points lie on a line of that slope.
    Points are float32: up to 4e-6 m off at 100 m, along lines metres long."""
    _, elevation, _ = by_ring(preset(name))
    for scan in velodyne_scans(file, model):
        for ring in np.unique(scan["ring"]):
            x, y, z = vectors(scan[scan["ring"] == ring], "x", "y", "z").T
            level = np.hypot(x, y)
            if np.ptp(level) < 1:
                continue
            slope = np.polyfit(level, z, 1)[0]
            assert abs(np.degrees(np.arctan(slope) - elevation[ring])) < 2e-5


@pytest.mark.parametrize(("file", "model", "name", "period"), VELODYNES)
def test_velodyne_firing_times_and_azimuths_match_the_decoder(file, model, name, period):
    """Within a sequence, less our own times and angles, nothing may be left but roundings: times
    are float32 near 0.1 s (7.5 ns), azimuths lie between two of hundredths of a degree."""
    firing, _, azimuth = by_ring(preset(name))
    for scan in velodyne_scans(file, model):
        time = scan["time"].astype(float)
        begin = time - firing[scan["ring"]]
        angle = np.unwrap(np.arctan2(scan["y"], scan["x"]).astype(float) - azimuth[scan["ring"]])
        rate = np.polyfit(time, angle, 1)[0]
        head = angle - rate * firing[scan["ring"]]
        sequence = np.concatenate([[0], np.cumsum(np.abs(np.diff(begin)) > period / 2)])
        starts = np.unique(sequence, return_index=True)[1]
        assert len(starts) > 500
        for values, bound in ((begin, 16e-9), (head, np.radians(0.02))):
            spread = np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts)
            assert spread.max() < bound
        # From one sequence to the next: whole periods; packets are stamped in microseconds.
        steps = np.diff(begin[starts])
        assert np.abs(steps - np.round(steps / period) * period).max() < 1.1e-6


def read_pcd(path):
    raw = path.read_bytes()
    begin = raw.index(b"DATA binary\n") + len(b"DATA binary\n")
    lines = [line.split() for line in raw[:begin].decode().splitlines()]
    head = {words[0]: words[1:] for words in lines}
    kinds = {"F": "f", "U": "u", "I": "i"}
    fields = zip(head["FIELDS"], head["TYPE"], head["SIZE"], strict=True)
    layout = np.dtype([(field, f"<{kinds[kind]}{size}") for field, kind, size in fields])
    return np.frombuffer(raw[begin:], layout, int(head["POINTS"][0]))


@pytest.mark.parametrize(
    ("cloud", "name"),
    [
        ("vlp16_1673400472138016708", "velodyne_vlp16"),
        ("vlp32_1713492677464078412", "velodyne_vlp32c"),
    ],
)
def test_every_point_of_nebula_has_one_of_our_elevations(cloud, name):
    """Coordinates are float32: 1e-7 of the range, a few roundings."""
    x, y, z = vectors(read_pcd(SHARED / f"nebula_velodyne_hesai/{cloud}.pcd"), "x", "y", "z").T
    ours = by_ring(preset(name))[1]
    elevation = np.arctan2(z, np.hypot(x, y))
    nearest = np.abs(elevation[:, None] - ours[None, :]).min(axis=1)
    assert nearest.max() < 1e-6


def test_nebula_vlp16_firing_times_match_ours():
    """Nebula's stamps went through steps of 2^-22 s."""
    points = read_pcd(SHARED / "nebula_velodyne_hesai/vlp16_1673400472138016708.pcd")
    firing, elevation, _ = by_ring(preset("velodyne_vlp16"))
    x, y, z = vectors(points, "x", "y", "z").T
    assert np.abs(np.arctan2(z, np.hypot(x, y)) - elevation[points["channel"]]).max() < 1e-6
    sequences = (points["time_stamp"] * 1e-9 - firing[points["channel"]]) / 55.296e-6
    sequences -= np.median(sequences - np.round(sequences))
    assert np.abs(sequences - np.round(sequences)).max() * 55.296e-6 < 2.0**-22
