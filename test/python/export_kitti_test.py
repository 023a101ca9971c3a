"""KITTI and SemanticKITTI folders, read by pykitti and by the rules of SemanticKITTI's API."""

import cv2
import numpy as np
import pytest
import yaml
from export_runs import export, mount, pose_between, run_folder, scans, still, world_of

pykitti = pytest.importorskip("pykitti", reason="pip install -r test/requirements.txt")

EXPOSURE_S = 0.002
FLOAT_M = 2e-5  # floats of 100 m have 8e-6 m, twice: as recorded and as exported


@pytest.fixture(scope="module")
def kitti(tmp_path_factory):
    out = tmp_path_factory.mktemp("kitti") / "out"
    assert export("kitti", out, "--lidar", "front", "--lidar", "bare-16") == 0
    return out


@pytest.fixture(scope="module")
def semantic(tmp_path_factory):
    out = tmp_path_factory.mktemp("semantic_kitti") / "out"
    assert export("semantic-kitti", out, "--lidar", "top", "--no-images", "--sequence", "8") == 0
    return out


def frame_times_s():
    record = yaml.safe_load((run_folder() / "dataset.yaml").read_text())
    begins = [each["stamp_s"] for each in record["frames"] if each["sensor"] == "left"]
    return np.array(begins) + EXPOSURE_S / 2


@pytest.mark.parametrize(("sequence", "lidar"), [("00", "front"), ("01", "bare-16")])
def test_pykitti_places_every_point_at_its_true_position(kitti, sequence, lidar):
    read = pykitti.odometry(kitti, sequence)
    times_s = frame_times_s()
    assert len(read) == len(times_s) == 3
    seconds = [each.total_seconds() for each in read.timestamps]
    np.testing.assert_allclose(seconds, times_s - times_s[0], atol=1e-6)  # what a timedelta has
    X_D0 = pose_between("left", times_s[0])
    for i, (_, rows) in enumerate(scans(lidar)):
        points = read.get_velo(i)
        assert len(points) == len(rows)
        np.testing.assert_array_equal(points[:, 3], rows["intensity"])
        X_DS = X_D0 @ read.poses[i] @ read.calib.T_cam0_velo
        in_world = points[:, :3].astype(float) @ X_DS[:3, :3].T + X_DS[:3, 3]
        # The path between its lines by slerp, not by screws: well below a millimetre.
        np.testing.assert_allclose(in_world, world_of(rows), atol=3e-4)


def test_poses_are_left_camera_poses_relative_to_the_first(kitti):
    read = pykitti.odometry(kitti, "00")
    times_s = frame_times_s()
    first = np.linalg.inv(pose_between("left", times_s[0]))
    for time_s, pose in zip(times_s, read.poses, strict=True):
        np.testing.assert_allclose(pose, first @ pose_between("left", time_s), atol=1e-4)


def test_cameras_are_the_rectified_pair(kitti):
    read = pykitti.odometry(kitti, "00")
    said = yaml.safe_load((run_folder() / "calibration/left.yaml").read_text())["rectification"]
    right = yaml.safe_load((run_folder() / "calibration/right.yaml").read_text())["rectification"]
    K = [
        [said["focal_px"][0], 0, said["centre_px"][0]],
        [0, said["focal_px"][1], said["centre_px"][1]],
    ]
    np.testing.assert_allclose(read.calib.K_cam2[:2], K, rtol=1e-12)
    assert read.calib.b_rgb == pytest.approx(right["right_of_left_m"], rel=1e-9)
    expected = np.linalg.inv(mount("left", "X_BC")) @ mount("front", "X_BS")
    np.testing.assert_allclose(read.calib.T_cam0_velo, expected, atol=1e-12)
    for i in range(3):
        for image, camera in ((read.get_cam2(i), "left"), (read.get_cam3(i), "right")):
            picture = cv2.imread(str(run_folder() / f"camera/{camera}/{i:06}.png"))
            np.testing.assert_array_equal(np.asarray(image), picture[..., ::-1])


@pytest.mark.parametrize(("sequence", "lidar"), [("00", "front"), ("01", "bare-16")])
def test_points_project_to_the_pixels_that_show_them(kitti, sequence, lidar):
    """The oracle is the run's table of echoes and their pixels."""
    read = pykitti.odometry(kitti, sequence)
    checked = 0
    for i, (_, rows) in enumerate(scans(lidar)):
        table = np.load(run_folder() / f"camera/left/{i:06}_{lidar}.npy")
        table = table[
            still(rows)[table["echo"]] & (table["is_inside"] == 1) & (table["depth_m"] > 1)
        ]
        points = np.c_[read.get_velo(i)[table["echo"], :3], np.ones(len(table))]
        in_image = points @ (read.calib.P_rect_20 @ read.calib.T_cam0_velo).T
        np.testing.assert_allclose(in_image[:, 2], table["depth_m"], atol=FLOAT_M)
        in_image = in_image[:, :2] / in_image[:, 2:]
        # 80 px a radian: a micrometre's error at a metre is 1e-4 px, and floats have some.
        np.testing.assert_allclose(in_image[:, 0], table["u_px"], atol=80 * FLOAT_M)
        np.testing.assert_allclose(in_image[:, 1], table["v_px"], atol=80 * FLOAT_M)
        checked += len(table)
    assert checked > 1000


def test_image_depths_agree_with_projected_points(kitti):
    """Compared on the true plane of the pixel, where it and its neighbours show ground."""
    import OpenEXR

    read = pykitti.odometry(kitti, "01")
    X_D0 = pose_between("left", frame_times_s()[0])
    agree = total = 0
    for i, (_, rows) in enumerate(scans("bare-16")):
        file = run_folder() / f"camera/left/{i:06}.exr"
        with OpenEXR.File(str(file), separate_channels=True) as exr:
            channels = {name: each.pixels.astype(float) for name, each in exr.channels().items()}
        near = np.where(channels["Label"] == 40, channels["Z"], 1e9)
        around = np.ones((3, 3))
        is_ground = cv2.dilate(near, around) < 1.3 * cv2.erode(near, around)  # and has no crest
        table = np.load(run_folder() / f"camera/left/{i:06}_bare-16.npy")
        table = table[(rows["label"][table["echo"]] == 40) & (table["is_visible"] == 1)]
        in_camera = read.get_velo(i)[table["echo"]].astype(float)
        in_camera[:, 3] = 1
        in_camera = in_camera @ read.calib.T_cam0_velo[:3].T
        in_image = in_camera @ read.calib.K_cam2.T
        u, v = np.rint(in_image[:, :2] / in_image[:, 2:]).astype(int).T
        in_camera, u, v = in_camera[is_ground[v, u]], u[is_ground[v, u]], v[is_ground[v, u]]
        ahead = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(read.calib.K_cam2).T
        depth_m = channels["Z"][v, u]
        offset = (ahead * depth_m[:, None] - in_camera) @ (X_D0 @ read.poses[i])[:3, :3].T
        normal = np.stack([channels[f"N.{axis}"][v, u] for axis in "XYZ"], axis=-1)
        # A pixel is 1/80 of its depth wide, over which the ground is not quite a plane.
        agree += np.count_nonzero(np.abs(np.sum(offset * normal, axis=1)) < 0.01 + 0.002 * depth_m)
        total += len(depth_m)
    assert total > 500
    assert agree > 0.99 * total


def test_without_images_every_scan_is_a_frame(semantic):
    read = pykitti.odometry(semantic, "08")
    stamps_s = np.array([stamp_s for stamp_s, _ in scans("top")])
    seconds = [each.total_seconds() for each in read.timestamps]
    np.testing.assert_allclose(seconds, stamps_s - stamps_s[0], atol=1e-6)
    # Camera 0 stands at the lidar and looks along its x.
    Tr = read.calib.T_cam0_velo
    np.testing.assert_allclose(
        Tr, [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], atol=1e-12
    )
    poses = np.loadtxt(semantic / "sequences/08/poses.txt").reshape(-1, 3, 4)
    first = np.linalg.inv(pose_between("top", stamps_s[0]))
    for stamp_s, pose in zip(stamps_s, poses, strict=True):
        X_C0C = np.vstack([pose, [0, 0, 0, 1]])
        in_lidar = np.linalg.inv(Tr) @ X_C0C @ Tr  # as SemanticKITTI's API turns it
        np.testing.assert_allclose(in_lidar, first @ pose_between("top", stamp_s), atol=1e-4)


def instances_of(folder, labels, instances):
    """Maps the dataset's instances by instances.txt; returns them unchanged without it."""
    file = folder / "instances.txt"
    if not file.exists():
        return instances
    table = np.loadtxt(file, dtype=int, ndmin=2)
    assert len({(label, here) for label, here, _ in table}) == len(table)  # none stands for two
    here = {(label, ours): number for label, number, ours in table}
    pairs = zip(labels.tolist(), instances.tolist(), strict=True)
    return np.array([here[pair] if pair[1] else 0 for pair in pairs])


def test_labels_are_in_the_order_of_the_points(semantic):
    folder = semantic / "sequences/08"
    for i, (_, rows) in enumerate(scans("top")):
        scan = np.fromfile(folder / f"velodyne/{i:06}.bin", dtype=np.float32).reshape(-1, 4)
        label = np.fromfile(folder / f"labels/{i:06}.label", dtype=np.uint32).reshape(-1)
        assert len(label) == len(scan) == len(rows)
        np.testing.assert_array_equal(label & 0xFFFF, rows["label"])
        expected = instances_of(folder, rows["label"], rows["instance"])
        np.testing.assert_array_equal(label >> 16, expected)
    assert {10, 40, 70, 72} <= set(np.unique(label & 0xFFFF))


def test_a_label_map_replaces_labels_and_keeps_selected_instances(tmp_path):
    (tmp_path / "map.yaml").write_text("labels: {10: 252, 40: 49}\nothers: 70\ninstances: [10]\n")
    options = ["--labels", str(tmp_path / "map.yaml"), "--lidar", "bare-16", "--no-images"]
    assert export("semantic-kitti", tmp_path / "out", *options) == 0
    folder = tmp_path / "out/sequences/00"
    for i, (_, rows) in enumerate(scans("bare-16")):
        label = np.fromfile(folder / f"labels/{i:06}.label", dtype=np.uint32)
        expected = np.select([rows["label"] == 10, rows["label"] == 40], [252, 49], 70)
        np.testing.assert_array_equal(label & 0xFFFF, expected)
        kept = np.where(rows["label"] == 10, rows["instance"], 0)
        np.testing.assert_array_equal(label >> 16, instances_of(folder, expected, kept))
    assert np.any(kept)


def test_a_label_map_without_an_occurring_label_is_rejected(tmp_path, capsys):
    (tmp_path / "map.yaml").write_text("labels: {40: 49}\n")
    options = ["--labels", str(tmp_path / "map.yaml"), "--lidar", "top", "--no-images"]
    assert export("semantic-kitti", tmp_path / "out", *options) == 1
    assert "it has no number for the label 10; add it to labels" in capsys.readouterr().err
    assert sorted(each.name for each in tmp_path.iterdir()) == ["map.yaml"]


def test_instances_beyond_16_bits_are_renumbered():
    from groundray.dataset import Dataset, ObjectGroup
    from groundray.export.labels import Instances, LabelMap

    data = Dataset(run_folder())
    data.object_groups = [ObjectGroup("grass", 72, 1, 200_000)]
    instances = Instances(data, LabelMap(None, 65535))
    rows = np.array([(72, 150_000), (72, 9), (10, 70_000), (40, 0), (72, 150_000)], "u2, u4")
    rows.dtype.names = ("label", "instance")
    assert instances.of(rows, rows["label"].astype(np.uint32)).tolist() == [1, 2, 1, 0, 1]
    later = np.array([(72, 11), (72, 9)], rows.dtype)
    assert instances.of(later, later["label"].astype(np.uint32)).tolist() == [3, 2]
    assert instances.numbers == {(72, 150_000): 1, (72, 9): 2, (10, 70_000): 1, (72, 11): 3}
