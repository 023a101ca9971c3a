"""Damaged datasets: one error with the location, and nothing written."""

import os
import re
import shutil

import numpy as np
import pytest
from detection_runs import FORMS as OF_BOXES
from detection_runs import copy_of
from export_runs import export, fails, names_in

OF_SCANS_TOO = [form for form in OF_BOXES if form != "coco"]


@pytest.fixture
def run(tmp_path, request):
    """A copy of the dataset that tests may modify."""
    return copy_of(request, tmp_path / "run")


def test_missing_and_broken_datasets_are_reported(run, capsys):
    record = run / "dataset.yaml"
    text = record.read_text()
    for spoiled, rule in (
        (text[: len(text) // 2], "dataset.yaml"),
        (text.replace("groundray_dataset: 1", "groundray_dataset: 2"), "must be 1"),
        (text.replace("origin_w_m: [", "origin_w_m: [east, "), "must be numeric"),
        (text[: text.rindex("  - {sensor")], "was the file cut short?"),
        (text.replace("kind: lidar", "kind: sonar", 1), "must be lidar, camera or stereo"),
        ("", "must be a map"),
        ("frames: [", "dataset.yaml:2:1: "),
        ("a: &a [1]\nb: [*a, *a]\n", "dataset.yaml:2:5: aliases (*name) are not allowed"),
    ):
        record.write_text(spoiled)
        assert rule in fails(capsys, run, "npz")
    record.unlink()
    assert "it contains no dataset.yaml" in fails(capsys, run, "npz")


@pytest.mark.parametrize("name", ["calibration/front.yaml", "lidar/front/000001.ply"])
def test_pipes_are_rejected(run, capsys, name):
    (run / name).unlink()
    os.mkfifo(run / name)
    assert name in fails(capsys, run, "npz")


@pytest.mark.parametrize("form", ["kitti", "npz", "mcap", "laz", *OF_SCANS_TOO])
def test_missing_and_damaged_scans_are_reported(run, capsys, form):
    options = ["--lidar", "front"]
    file = run / "lidar/front/000001.ply"
    data = file.read_bytes()
    for spoiled, rule in (
        (data[:-1], "its header requires"),
        (data + b"\0", "its header requires"),
        (data[:100], "is it damaged?"),
        (data.replace(b"property float x\n", b"property float q\n", 1), "it lacks x"),
        (data.replace(b"binary_little_endian", b"ascii", 1), "is it damaged?"),
        (b"", "is it damaged?"),
    ):
        file.write_bytes(spoiled)
        line = fails(capsys, run, form, *options)
        assert "lidar/front/000001.ply: " in line
        assert rule in line
    file.unlink()
    assert "although dataset.yaml lists it as done; was it removed?" in fails(
        capsys, run, form, *options
    )


@pytest.mark.parametrize("form", ["kitti", "tum", "mcap", *OF_BOXES])
def test_missing_and_damaged_images_are_reported(run, capsys, form):
    file = run / "camera/right/000001.png"
    data = file.read_bytes()
    for spoiled in (data[:-10], b"", data[:12] + b"JUNK" + data[16:], None):
        file.unlink(missing_ok=True)
        if spoiled is not None:
            file.write_bytes(spoiled)
        line = fails(capsys, run, form)
        assert "camera/right/000001.png: " in line
        assert ("was it removed?" if spoiled is None else "it is damaged") in line
    file.write_bytes((run / "camera/right/000000_preview.png").read_bytes())
    assert "must have 96 x 72 pixels" in fails(capsys, run, form)


@pytest.mark.parametrize("form", ["kitti", "tum", "mcap", *OF_BOXES])
def test_a_missing_first_picture_is_reported(run, capsys, form):
    (run / "camera/left/000000.png").unlink()
    line = fails(capsys, run, form, "--camera", "left", "--camera", "right")
    assert "camera/left/000000.png: " in line
    assert "was it removed?" in line


@pytest.mark.parametrize("form", OF_BOXES)
def test_missing_and_damaged_boxes_are_reported(run, capsys, form):
    file = run / "camera/left/000000_boxes.npy"
    data = file.read_bytes()
    begin = data.index(b"\n") + 1
    rows = np.frombuffer(data, np.load(file).dtype, offset=begin)

    def changed(name, value):
        spoiled = rows.copy()
        spoiled[name][0] = value
        return data[:begin] + spoiled.tobytes()

    for spoiled, rule in (
        (data[:-1], "its header requires"),
        (data + b"\0", "its header requires"),
        (data[:20], "it is not a table of boxes"),
        (b"", "it is not a table of boxes"),
        (data[:6] + b"\x09\x00" + data[8:], "it is not a table of boxes"),
        (data.replace(b"'length_m'", b"'lengthwm'", 1), "it must be a list of rows of instance"),
        (data.replace(b"False", b"false", 1), "it is not a table of boxes"),
        (changed("x_m", np.nan), "has invalid values"),
        (changed("time_s", 1e30), "has invalid values"),
        (changed("qw", 7), "has invalid values"),
        (changed("width_m", -1), "has invalid values"),
        (changed("visible_u_max", 96), "is not inside the image"),
        (None, "was it removed?"),
    ):
        file.unlink()
        if spoiled is not None:
            file.write_bytes(spoiled)
        line = fails(capsys, run, form)
        assert "camera/left/000000_boxes.npy: " in line
        assert rule in line
        file.write_bytes(data)


def test_points_with_invalid_coordinates_or_times_are_reported(run, capsys):
    file = run / "lidar/front/000001.ply"
    data = file.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    for place, value in ((0, np.nan), (8, np.inf), (16, np.nan), (16, -1)):  # x, z, time
        spoiled = bytearray(data)
        spoiled[begin + place : begin + place + 4] = np.float32(value).tobytes()
        file.write_bytes(spoiled)
        assert "points with invalid coordinates or times" in fails(capsys, run, "npz")


def test_missing_and_damaged_depths_are_reported(run, capsys):
    file = run / "camera/eye/000001.exr"
    data = file.read_bytes()
    for spoiled in (data[: len(data) // 2], data[:40], b"", None):
        file.unlink(missing_ok=True)
        if spoiled is not None:
            file.write_bytes(spoiled)
        assert "camera/eye/000001.exr: " in fails(capsys, run, "tum", "--camera", "eye")


@pytest.mark.parametrize("form", ["kitti", "pcd", "npz", "las", "mcap", *OF_SCANS_TOO])
def test_broken_trajectories_are_reported(run, capsys, form):
    file = run / "poses/top.tum"
    lines = file.read_text().splitlines()
    for spoiled, rule in (
        ([*lines[:-1], lines[-1][:40]], "eight finite numbers"),
        ([*lines, lines[-1]], "its times do not increase"),
        ([*lines[:-1], re.sub(r"\S+$", "7", lines[-1])], "the quaternion must have length 1"),
        ([*lines[:-1], re.sub(r"\S+$", "nan", lines[-1])], "eight finite numbers"),
        (["# nothing"], "it has no pose"),
        (lines[20:], "the path begins at"),
    ):
        file.write_text("\n".join(spoiled))
        if form == "mcap" and "begins" in rule:
            continue  # a bag's transforms may begin when they like
        line = fails(capsys, run, form)
        assert "poses/top.tum" in line
        assert rule in line


@pytest.mark.parametrize("form", ["kitti", "tum", "npz", "mcap", *OF_BOXES])
@pytest.mark.parametrize("key", ["focal_px", "centre_px"])
def test_lenses_without_a_key_are_reported(run, capsys, form, key):
    file = run / "calibration/left.yaml"
    file.write_text(re.sub(rf"\b{key}:", f"{key}x:", file.read_text(), count=1))
    line = fails(capsys, run, form)
    assert "calibration/left.yaml: lens." in line
    assert f".{key} is missing" in line


ABSURD = ["inf", "-inf", "nan", "1e30", "-1e30", "1e999999999", "5000000000", "soon"]


@pytest.mark.parametrize("form", ["kitti", "tum", "npz", "laz", "mcap", *OF_SCANS_TOO])
@pytest.mark.parametrize("time", ABSURD)
def test_times_out_of_range_are_reported(run, capsys, form, time):
    """Stamps, the origin, lines of paths, and exposures."""
    sensor = "left" if form == "tum" else "top"
    for name, place, reported in (
        ("dataset.yaml", rf'(sensor: "{sensor}", frame: 1, stamp_s: )[^,]+', "stamp_s = "),
        ("dataset.yaml", r"(time_origin_s: ).*", "time_origin_s = "),
        (f"poses/{sensor}.tum", r"(?m)^()[^ #]+", f"poses/{sensor}.tum:"),
        ("calibration/left.yaml", r"(exposure_s: ).*", "exposure_s = "),
    ):
        whole = (run / name).read_text()
        spoiled, count = re.subn(place, rf"\g<1>{time}", whole, count=1)
        assert count == 1, place
        (run / name).write_text(spoiled)
        line = fails(capsys, run, form)
        assert reported in line
        assert "must be" in line
        (run / name).write_text(whole)


@pytest.mark.parametrize("form", ["kitti", "npz", "laz", "mcap"])
def test_a_scan_long_after_its_trajectory_is_reported(run, capsys, form):
    record = run / "dataset.yaml"
    text = re.sub(
        r"(sensor: \"bare-16\", frame: 2,.*? stamp_s: )[^,}]+", r"\g<1>4e9", record.read_text()
    )
    assert "4e9" in text
    record.write_text(text)
    options = ["--no-images"] if form == "kitti" else []  # else scans without an image are skipped
    line = fails(capsys, run, form, "--lidar", "bare-16", *options)
    assert "but 4000000000.0" in line
    assert "the path ends at 0." in line


@pytest.mark.parametrize("form", ["mcap", "kitti", *OF_BOXES])
def test_random_damage_causes_one_error_or_none(run, capsys, form):
    """Random bits are flipped and ends cut, in everything except pixels and points."""
    random = np.random.default_rng(3)
    files = ["dataset.yaml", "poses/front.tum", "calibration/front.yaml", "calibration/left.yaml"]
    files += ["calibration/left.ros.yaml", "lidar/front/000000.ply"]
    files += ["camera/left/000000_boxes.npy"] if form in OF_BOXES else []
    options = ["--camera", "left"] if form == "coco" else ["--lidar", "front"]
    for name in files:
        data = (run / name).read_bytes()
        for trial in range(8):
            spoiled = bytearray(data)
            if trial % 2:
                spoiled = spoiled[: random.integers(len(spoiled))]
            else:
                for place in random.integers(min(len(spoiled), 2000), size=3):
                    spoiled[place] ^= 1 << random.integers(8)
            (run / name).write_bytes(spoiled)
            code = export(form, run.parent / "out", *options, source=run)
            reported = capsys.readouterr().err
            assert (code == 0 and not reported) or (code == 1 and reported.count("\n") >= 1), name
            assert "Traceback" not in reported
            shutil.rmtree(run.parent / "out", ignore_errors=True)
            assert names_in(run.parent) == ["run"]
        (run / name).write_bytes(data)
