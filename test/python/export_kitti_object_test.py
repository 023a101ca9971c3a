"""KITTI object folders, read by Open3D-ML."""

import shutil

import numpy as np
import pytest
from detection_runs import (
    SIGNS,
    boxed_folder,
    boxes_of,
    corners_of_box,
    half_of_box,
    mount_of,
    moved,
    pinhole_of,
    pose_of,
    pose_of_box,
    projected,
    scan_of,
    speed,
    stamps_s,
)
from export_runs import export, fails, names_in, run_folder
from scipy.spatial.transform import Rotation

reader = pytest.importorskip(
    "open3d._ml3d.datasets.kitti",
    reason="pip install -r test/requirements.txt",
    exc_type=ImportError,
)

MIDDLE_S = 0.001  # of the exposure
# The path between its lines by slerp, not by screws, and Open3D's floats of 30 m.
PLACE_M = 3e-4
# 66 px a radian, at 3 m or more.
PLACE_PX = 66 * PLACE_M / 3
TYPES = {4: "Rock", 6: "Tree", 10: "Car", 11: "Pedestrian"}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    out = tmp_path_factory.mktemp("kitti_object") / "out"
    assert export("kitti-object", out, source=boxed_folder()) == 0
    return out


def frames(out):
    """Yields each frame's number, its data as Open3D reads them, and the boxes of its image."""
    kitti = reader.KITTI(str(out), use_cache=False)
    for i in range(len(kitti.train_files)):
        yield i, kitti.get_split("train").get_data(i), boxes_of("left", i)


def text(out, i, folder="label_2"):
    return (out / f"training/{folder}/{i:06}.txt").read_text().splitlines()


def matrix_in(out, i, name):
    (line,) = (line for line in text(out, i, "calib") if line.startswith(f"{name}: "))
    return np.array(line.split()[1:], float).reshape(3, -1)


def pose_in_camera(box, i):
    after_s = MIDDLE_S
    return np.linalg.inv(pose_of("left", stamps_s("left")[i] + after_s)) @ pose_of_box(box, after_s)


# The axes of KITTI's boxes are along, down and to the left in those of the object.
AXES = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])


def swing_and_twist(box, i):
    """Splits a box's turn in the camera: about its y axis, by an angle, then by the rest."""
    turn = Rotation.from_matrix(pose_in_camera(box, i)[:3, :3] @ AXES)
    _, y, _, w = turn.as_quat()
    twist = Rotation.from_quat([0, y, 0, w])
    return turn * twist.inv(), 2 * np.arctan2(y, w)


def kitti_corners(box):
    """Returns the corners by Open3D in the order of SIGNS."""
    here = box.generate_corners3d()
    along, across = [1, 1, -1, -1], [1, -1, -1, 1]  # Open3D's, first below, then above
    theirs = [(along[k % 4], across[k % 4], -1 if k < 4 else 1) for k in range(8)]
    return np.stack([here[theirs.index(tuple(signs))] for signs in SIGNS.tolist()])


def test_corners_are_those_of_the_dataset_but_for_the_tilt(exported):
    """A KITTI box lacks the rotation out of the camera's horizontal plane: put back, all agree."""
    checked = 0
    for i, data, boxes in frames(exported):
        assert len(data["bounding_boxes"]) == len(boxes)
        X_CD = np.linalg.inv(pose_of("left", stamps_s("left")[i] + MIDDLE_S))
        P = matrix_in(exported, i, "P2")
        np.testing.assert_allclose(P, np.c_[pinhole_of("left"), np.zeros(3)], rtol=1e-12)
        for box, row in zip(data["bounding_boxes"], boxes, strict=True):
            swing, twist_rad = swing_and_twist(row, i)
            turn_rad = (box.yaw - twist_rad + np.pi) % (2 * np.pi) - np.pi
            assert abs(turn_rad) < 1e-4  # the slerp's angles differ by less
            corners = kitti_corners(box)
            centre = corners.mean(axis=0)
            restored = swing.apply(corners - centre) + centre
            expected = moved(X_CD, corners_of_box(row, MIDDLE_S))
            reach = np.linalg.norm(half_of_box(row))
            np.testing.assert_allclose(restored, expected, atol=PLACE_M + 1e-4 * reach)
            # A rotation by an angle moves a point by 2 sin(angle / 2) of its distance.
            off_m = np.linalg.norm(corners - expected, axis=1).max()
            assert off_m <= 2 * np.sin(swing.magnitude() / 2) * reach + PLACE_M + 1e-4 * reach
            if expected[:, 2].min() > 3:
                in_image = projected(P[:, :3], restored)
                in_picture = projected(pinhole_of("left"), expected)
                np.testing.assert_allclose(in_image, in_picture, atol=3 * PLACE_PX)
                left, top, right, bottom = box.box2d
                low, high = in_picture.min(axis=0), in_picture.max(axis=0)
                # A pixel is within half of one of what it shows.
                assert np.all([left, top] >= low - 0.5 - PLACE_PX)
                assert np.all([right, bottom] <= high + 0.5 + PLACE_PX)
                checked += 1
    assert checked > 100


def test_labels_are_those_of_the_boxes(exported):
    states = set()
    for i, data, boxes in frames(exported):
        lines = text(exported, i)
        for line, box, row in zip(lines, data["bounding_boxes"], boxes, strict=True):
            words = line.split()
            assert len(words) == 15
            assert words[0] == TYPES[row["label"]]
            rectangle = [row[f"alone_{end}"] for end in ("u_min", "v_min", "u_max", "v_max")]
            assert box.box2d.tolist() == rectangle
            assert box.truncation == pytest.approx(row["truncated_share"], abs=1e-6)
            share = row["visible_share"]
            assert box.occlusion == (0 if share >= 0.9 else 1 if share >= 0.5 else 2)
            states.add(int(box.occlusion))
            size = [row["width_m"], row["height_m"], row["length_m"]]
            np.testing.assert_allclose(box.size, size, atol=1e-6)
            x_m, z_m = float(words[11]), float(words[13])
            ahead_rad = box.yaw - np.arctan2(x_m, z_m)  # the ray to it is ahead at 0
            assert np.cos(box.alpha - ahead_rad) > 1 - 1e-9
            assert abs(box.alpha) <= np.pi
            assert abs(box.yaw) <= np.pi
    assert states == {0, 1, 2}


def test_points_of_an_instance_are_in_its_box(exported):
    checked = 0
    for i, data, boxes in frames(exported):
        rows, begin_s = scan_of("top", i), stamps_s("top")[i]
        assert len(data["full_point"]) == len(rows)
        np.testing.assert_array_equal(data["full_point"][:, 3], rows["intensity"])
        R0 = matrix_in(exported, i, "R0_rect")
        X_CS = matrix_in(exported, i, "Tr_velo_to_cam")
        time_s = stamps_s("left")[i] + MIDDLE_S
        for box, row in zip(data["bounding_boxes"], boxes, strict=True):
            own = np.flatnonzero(rows["instance"] == row["instance"])
            if not len(own):
                continue
            points = data["full_point"][own, :3].astype(float)
            in_camera = (points @ X_CS[:, :3].T + X_CS[:, 3]) @ R0.T
            corners = kitti_corners(box)
            centre = corners.mean(axis=0)
            # Limbs are up to three times as fast as the body.
            apart_s = np.abs(rows["time"][own] + begin_s - time_s)
            reach_m = 3 * speed(row) * apart_s + PLACE_M
            swing, _ = swing_and_twist(row, i)
            turn = swing * Rotation.from_rotvec([0, box.yaw, 0])
            half = half_of_box(row)[[0, 2, 1]]  # along, down, to the left
            off_m = np.abs(turn.inv().apply(in_camera - centre)) - half
            assert np.all(off_m.max(axis=1) <= reach_m + 1e-4 * np.linalg.norm(half))
            # Without the tilt, which KITTI cannot state.
            level = Rotation.from_rotvec([0, box.yaw, 0])
            off_m = np.abs(level.inv().apply(in_camera - centre)) - half
            tilt_m = 2 * np.sin(swing.magnitude() / 2) * (np.linalg.norm(half) + reach_m)
            assert np.all(off_m.max(axis=1) <= reach_m + tilt_m + 1e-4 * np.linalg.norm(half))
            checked += len(own)
    assert checked > 1000


def test_calibration_and_pictures_are_those_of_the_sensors(exported):
    left, right, top = mount_of("left"), mount_of("right"), mount_of("top")
    for i in range(12):
        X_CS = matrix_in(exported, i, "Tr_velo_to_cam")
        np.testing.assert_allclose(X_CS, (np.linalg.inv(left) @ top)[:3], atol=1e-12)
        X_SB = matrix_in(exported, i, "Tr_imu_to_velo")
        np.testing.assert_allclose(X_SB, np.linalg.inv(top)[:3], atol=1e-12)
        np.testing.assert_array_equal(matrix_in(exported, i, "R0_rect"), np.eye(3))
        K_right = pinhole_of("right")
        P3 = K_right @ (np.linalg.inv(right) @ left)[:3]
        np.testing.assert_allclose(matrix_in(exported, i, "P3"), P3, atol=1e-9)
        for name, same in (("P0", "P2"), ("P1", "P3")):
            np.testing.assert_array_equal(
                matrix_in(exported, i, name), matrix_in(exported, i, same)
            )
        for folder, camera in (("image_2", "left"), ("image_3", "right")):
            ours = (exported / f"training/{folder}/{i:06}.png").read_bytes()
            assert ours == (boxed_folder() / f"camera/{camera}/{i:06}.png").read_bytes()


def test_frames_are_split_by_time(exported, tmp_path, capsys):
    out = tmp_path / "out"
    assert export("kitti-object", out, "--split", "50,25,25", source=boxed_folder()) == 0
    assert "6 frames for train, 3 for val, 3 for test" in capsys.readouterr().out
    lists = {
        name: (out / f"ImageSets/{name}.txt").read_text().split()
        for name in ("train", "val", "trainval", "test")
    }
    assert lists["train"] == [f"{i:06}" for i in range(6)]
    assert lists["val"] == [f"{i:06}" for i in range(6, 9)]
    assert lists["trainval"] == lists["train"] + lists["val"]
    assert lists["test"] == [f"{i:06}" for i in range(3)]
    assert names_in(out / "testing") == ["calib", "image_2", "image_3", "velodyne"]
    for folder in names_in(out / "testing"):
        for i in range(9):
            (one,) = (out / "training" / folder).glob(f"{i:06}.*")
            assert one.read_bytes() == (exported / "training" / folder / one.name).read_bytes()
        for i in range(3):
            (one,) = (out / "testing" / folder).glob(f"{i:06}.*")
            same = exported / "training" / folder / f"{i + 9:06}{one.suffix}"
            assert one.read_bytes() == same.read_bytes()
    listed = [line.split() for line in (out / "frames.txt").read_text().splitlines()[1:]]
    assert [each[0] for each in listed[8:10]] == ["training/000008", "testing/000000"]
    times_s = np.array([int(each[3]) * 1e-9 for each in listed])
    np.testing.assert_allclose(times_s, np.array(stamps_s("left")) + MIDDLE_S, atol=1e-9)


def test_only_chosen_classes_are_labelled(tmp_path, capsys):
    options = ["--boxes-of", "person,vehicle", "--camera", "left"]
    assert export("kitti-object", tmp_path / "out", *options, source=boxed_folder()) == 0
    said = capsys.readouterr().out
    assert "note: boxes turn about the camera's y axis alone; their largest other" in said
    assert "note: KITTI's frames have one lidar, here top: front is left out" in said
    for i in range(12):
        types = {line.split()[0] for line in text(tmp_path / "out", i)}
        boxes = boxes_of("left", i)
        assert types == {TYPES[n] for n in boxes["label"] if n in (10, 11)}
        assert matrix_in(tmp_path / "out", i, "P3")[0, 3] == 0  # a single camera


def test_a_dataset_without_boxes_has_one_message(tmp_path, capsys):
    run = shutil.copytree(run_folder(), tmp_path / "run")
    line = fails(capsys, run, "kitti-object")
    assert "it has no image with boxes, which kitti-object needs; add boxes and picture" in line


@pytest.fixture
def run(tmp_path):
    return shutil.copytree(boxed_folder(), tmp_path / "run")


def test_a_box_of_another_time_is_moved_to_that_of_the_picture(exported, run):
    """As with a rolling shutter, boxes here have times of their own, along their velocity."""
    for i in range(12):
        file = run / f"camera/left/{i:06}_boxes.npy"
        boxes = np.load(file)
        later_s = 0.03 * np.random.default_rng(i).uniform(-1, 1, len(boxes))
        boxes["time_s"] += later_s
        for k in "xyz":
            boxes[f"{k}_m"] += later_s * boxes[f"v{k}_m_s"]
        np.save(file, boxes)
    out = run.parent / "out"
    assert export("kitti-object", out, source=run) == 0
    for i in range(12):
        for ours, line in zip(text(out, i), text(exported, i), strict=True):
            # Six decimals; times of boxes are rounded to nanoseconds.
            numbers, expected = (np.array(each.split()[1:], float) for each in (ours, line))
            np.testing.assert_allclose(numbers, expected, atol=2e-6)


def test_the_left_camera_must_have_boxes(run, capsys):
    for file in (run / "camera/left").glob("*_boxes.npy"):
        file.unlink()
    line = fails(capsys, run, "kitti-object")
    assert "camera left, the left one, has no boxes, which kitti-object needs; add boxes" in line
    assert export("kitti-object", run.parent / "out", "--camera", "right", source=run) == 0


def test_other_lenses_have_one_message(run, capsys):
    file = run / "calibration/left.yaml"
    file.write_text(file.read_text().replace("lens: {pinhole:", "lens: {equidistant:"))
    line = fails(capsys, run, "kitti-object")
    assert "camera left has the lens equidistant, but KITTI needs pinholes; use a pinhole" in line
    assert "--no-images" not in line
