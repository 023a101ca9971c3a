"""TUM RGB-D folders, read by evo and by the rules of TUM's own tools."""

import cv2
import numpy as np
import OpenEXR
import pytest
import yaml
from export_runs import export, pose_between, run_folder


def middle_s(camera):
    said = yaml.safe_load((run_folder() / f"calibration/{camera}.yaml").read_text())
    return (said["exposure_s"] + said["row_s"] * (said["size_px"][1] - 1)) / 2


def stamps_s(camera):
    record = yaml.safe_load((run_folder() / "dataset.yaml").read_text())
    begins = [each["stamp_s"] for each in record["frames"] if each["sensor"] == camera]
    return np.array(begins) + middle_s(camera)


def read_list(file):
    """Reads a list as TUM's tools do: time and rest of each line except comments."""
    lines = [line for line in file.read_text().splitlines() if line and not line.startswith("#")]
    return {float(line.split()[0]): line.split()[1:] for line in lines}


def associate(first, second, max_difference_s):
    """Returns pairs as TUM's tools do: closest first, each time once."""
    close = sorted(
        (abs(a - b), a, b) for a in first for b in second if abs(a - b) < max_difference_s
    )
    pairs = {}
    for _, a, b in close:
        if a not in pairs and b not in pairs.values():
            pairs[a] = b
    return pairs


@pytest.fixture(scope="module")
def tum(tmp_path_factory):
    out = tmp_path_factory.mktemp("tum") / "out"
    assert export("tum", out) == 0
    return out


def depths_m(camera, i):
    file = run_folder() / f"camera/{camera}/{i:06}.exr"
    with OpenEXR.File(str(file), separate_channels=True) as exr:
        return exr.channels()["Z"].pixels.astype(float)


@pytest.mark.parametrize("camera", ["left", "right", "eye"])
def test_depths_match_the_images_in_steps_of_a_fifth_of_a_millimetre(tum, camera):
    listed = read_list(tum / camera / "depth.txt")
    np.testing.assert_allclose(sorted(listed), stamps_s(camera), atol=1e-9)
    for i, (_, (name,)) in enumerate(sorted(listed.items())):
        depth = cv2.imread(str(tum / camera / name), cv2.IMREAD_UNCHANGED)
        expected_m = depths_m(camera, i)
        assert depth.dtype == np.uint16
        is_told = (
            np.isfinite(expected_m) & (expected_m > 0.5 / 5000) & (expected_m < 65535.4 / 5000)
        )
        np.testing.assert_array_equal(depth > 0, is_told)
        assert np.count_nonzero(is_told) > 1000
        np.testing.assert_allclose(depth[is_told] / 5000, expected_m[is_told], atol=0.5001 / 5000)


def test_pictures_match_the_run_and_are_associated_with_depths_and_poses(tum):
    folder = tum / "left"
    pictures, depths = read_list(folder / "rgb.txt"), read_list(folder / "depth.txt")
    poses = read_list(folder / "groundtruth.txt")
    assert all(a == b for a, b in associate(pictures, depths, 0.02).items())
    matches = associate(pictures, poses, 0.02)
    assert len(matches) == len(pictures) == 3
    for i, (time_s, (name,)) in enumerate(sorted(pictures.items())):
        written = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
        recorded = run_folder() / f"camera/left/{i:06}.png"
        np.testing.assert_array_equal(written, cv2.imread(str(recorded), cv2.IMREAD_UNCHANGED))
        assert matches[time_s] == pytest.approx(time_s, abs=1e-9)


def test_evo_reads_the_trajectory_of_the_run(tum):
    pytest.importorskip("evo", reason="pip install -r test/requirements.txt")
    from evo.tools import file_interface

    path = file_interface.read_tum_trajectory_file(str(tum / "left/groundtruth.txt"))
    valid, details = path.check()
    assert valid, details
    recorded = np.loadtxt(run_folder() / "poses/left.tum")
    times_s = np.union1d(recorded[:, 0].round(9), stamps_s("left").round(9))
    np.testing.assert_allclose(path.timestamps, times_s, atol=1e-9)
    for time_s, pose in zip(path.timestamps, path.poses_se3, strict=True):
        if time_s <= recorded[-1, 0]:
            np.testing.assert_allclose(pose, pose_between("left", time_s), atol=1e-4)


def test_a_single_camera_has_no_subfolder_and_the_depth_scale_is_selectable(tmp_path, capsys):
    assert export("tum", tmp_path / "out", "--camera", "eye", "--depth-per-m", "500") == 0
    reported = capsys.readouterr().out
    assert "note: camera eye has no pictures (product picture): there is no rgb.txt" in reported
    assert "a metre of depth is 500, not TUM's 5000" in reported
    assert "camera eye has a rolling shutter" in reported
    assert not (tmp_path / "out/rgb.txt").exists()
    ((_, (name,)), *_) = sorted(read_list(tmp_path / "out/depth.txt").items())
    depth = cv2.imread(str(tmp_path / "out" / name), cv2.IMREAD_UNCHANGED)
    expected_m = depths_m("eye", 0)
    is_told = np.isfinite(expected_m) & (expected_m > 0.002) & (expected_m < 131)
    np.testing.assert_allclose(depth[is_told] / 500, expected_m[is_told], atol=0.5001 / 500)
    assert (tmp_path / "out/calibration.yaml").read_text() == (
        run_folder() / "calibration/eye.yaml"
    ).read_text()
