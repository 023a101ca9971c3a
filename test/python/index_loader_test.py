"""groundray.index.Frames: arrays equal those of other readers, and each mistake has a message."""

import json
import pickle
import shutil
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from export_runs import run_folder
from groundray.dataset import Error
from groundray.index import Frames
from index_runs import WORLDS, index, worlds_folder

parquet = pytest.importorskip("pyarrow.parquet")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("loader") / "index.parquet"
    assert index(out, "--split", "train=0.6,test=0.4") == 0
    return out


@pytest.fixture
def own(tmp_path):
    """An index of copies of two datasets that tests may modify."""
    for world in ("000000", "000001"):
        shutil.copytree(worlds_folder() / world, tmp_path / "data" / world)
    assert index(tmp_path / "index.parquet", source=tmp_path / "data") == 0
    return tmp_path / "index.parquet"


def folder_of(frames, i):
    return frames.index.parent / frames.row(i)["dataset"]


def test_splits_share_the_frames_and_no_world(made):
    splits = {name: Frames(made, name) for name in ("train", "test")}
    assert sum(map(len, splits.values())) == len(Frames(made)) == 4 * WORLDS
    worlds = {
        name: {frames.row(i)["world"] for i in range(len(frames))}
        for name, frames in splits.items()
    }
    assert worlds["train"] | worlds["test"] == set(range(WORLDS))
    assert worlds["train"] & worlds["test"] == set()


def test_points_are_those_that_plyfile_reads(made):
    import plyfile

    frames = Frames(made, kind="lidar")
    for i, frame in enumerate(frames):
        row = frames.row(i)
        file = folder_of(frames, i) / f"lidar/{row['sensor']}/{row['frame']:06}.ply"
        data = plyfile.PlyData.read(file)["vertex"].data
        columns = list(frame)
        assert columns[-2:] == ["class_id", "X_DS"]
        assert len(columns) == len(data.dtype.names) + 2
        for name, theirs in zip(columns, data.dtype.names, strict=False):
            assert name.removesuffix("_m").removesuffix("_s").removesuffix("_rad") == theirs
            assert frame[name].dtype == data[theirs].dtype
            np.testing.assert_array_equal(frame[name], data[theirs])
        names = {0: "nothing", 4: "label 4"} | row["labels"]
        assert [frames.classes[k] for k in frame["class_id"]] == [names[k] for k in data["label"]]
    assert i + 1 == len(frames)


def test_images_are_those_that_opencv_and_openexr_read(made):
    import cv2
    import OpenEXR

    channels = ["picture", "label", "instance", "depth_m", "normal", "is_valid"]
    frames = Frames(made, sensors=["eye"], channels=channels)
    for i in range(len(frames)):
        base = folder_of(frames, i) / f"camera/eye/{frames.row(i)['frame']:06}"
        frame = frames[i]
        picture = cv2.imread(f"{base}.png", cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(frame["picture"], picture[..., ::-1])
        with OpenEXR.File(f"{base}.exr", separate_channels=True) as image:
            stored = {name: each.pixels for name, each in image.channels().items()}
        for name, theirs in (
            ("label", "Label"),
            ("instance", "Instance"),
            ("depth_m", "Z"),
            ("is_valid", "Valid"),
        ):
            assert frame[name].dtype == stored[theirs].dtype
            np.testing.assert_array_equal(frame[name], stored[theirs])
        for k, axis in enumerate("XYZ"):
            np.testing.assert_array_equal(frame["normal"][..., k], stored[f"N.{axis}"])
        assert frame["class_id"].shape == frame["label"].shape
        np.testing.assert_array_equal(frame["class_id"] == 0, frame["label"] == 0)
    assert set(Frames(made, kind="camera")[0]) == {
        *("picture", "label", "instance", "class_id", "X_DC")
    }


def test_the_pose_moves_points_to_the_world(made):
    """Without noise, points are the true ones but for the way of the sensor since the pose."""
    frame = Frames(made, kind="lidar")[0]
    first = frame["time_s"] < 5e-3
    points_m = np.stack([frame[f"{axis}_m"][first] for axis in "xyz"], axis=-1)
    world_m = np.stack([frame[f"world_{axis}_m"][first] for axis in "xyz"], axis=-1)
    X_DS = frame["X_DS"]
    apart_m = np.linalg.norm(points_m @ X_DS[:3, :3].T + X_DS[:3, 3] - world_m, axis=1)
    assert first.sum() > 50
    assert np.all(apart_m < 1e-4 + 10 * frame["time_s"][first])  # 8 m/s, and it sways


def test_columns_and_a_transform_are_chosen(made):
    frames = Frames(made, "train", kind="lidar", columns=["x_m", "label"], transform=len_of_points)
    assert frames[0] == frames.row(0)["points"] == frames[-len(frames)]
    frame = Frames(made, kind="lidar", columns=["label"])[0]
    assert list(frame) == ["label", "class_id", "X_DS"]


def len_of_points(frame):
    assert list(frame) == ["x_m", "label", "class_id", "X_DS"]
    return len(frame["x_m"])


def test_classes_have_one_number_in_datasets_that_label_them_differently(tmp_path):
    """Ground is 1 in one scene and 40 in the other; rock is 7 and 70."""
    out = tmp_path / "index.parquet"
    assert index(out, source=[worlds_folder(), run_folder()]) == 0
    frames = Frames(out, columns=["label"], channels=["label"])
    assert frames.classes == ("nothing", "grass", "ground", "label 4", "rock", "vehicle")
    seen = set()
    for i, frame in enumerate(frames):
        labels = frames.row(i)["labels"]
        for name in ("ground", "rock", "grass", "vehicle"):
            mine = [label for label, each in labels.items() if each == name]
            np.testing.assert_array_equal(
                frame["class_id"] == frames.classes.index(name), np.isin(frame["label"], mine)
            )
            seen.update((name, label) for label in mine if label in frame["label"])
    assert {("ground", 1), ("ground", 40), ("rock", 7), ("rock", 70)} <= seen


def test_pickles_and_other_processes_and_threads_read_the_same(made):
    frames = Frames(made, kind="lidar", columns=["x_m"])
    expected = [frames.row(i)["points"] for i in range(len(frames))]
    assert [len(frame["x_m"]) for frame in pickle.loads(pickle.dumps(frames))] == expected
    with ThreadPoolExecutor(4) as threads:
        read = list(threads.map(frames.__getitem__, range(len(frames))))
    assert [len(frame["x_m"]) for frame in read] == expected
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert len(pool.submit(frames.__getitem__, 3).result(timeout=120)["x_m"]) == expected[3]


@pytest.mark.parametrize("i", [4 * WORLDS, -4 * WORLDS - 1, 10**30])
def test_numbers_beyond_the_last_frame_are_reported(made, i):
    with pytest.raises(IndexError, match=rf"there is no frame {i}: it has {4 * WORLDS} frames"):
        Frames(made)[i]


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        ({"split": "tset"}, "there is no split tset; did you mean test? There are train, test"),
        ({"kind": "sonic"}, "there is no kind sonic; there are lidar, camera"),
        ({"sensors": ["roof"]}, "there is no sensor roof; there are eye, top"),
        ({"channels": ["depth"]}, "there is no channel depth; did you mean depth_m? There are"),
        ({"kind": "lidar", "sensors": ["eye"]}, "it has no such frame: check split, kind and"),
    ],
)
def test_unknown_names_are_reported(made, options, rule):
    with pytest.raises(Error) as raised:
        Frames(made, **options)
    assert f"{made}: {rule}" in str(raised.value)


def test_unknown_columns_and_absent_channels_are_reported(made):
    with pytest.raises(Error, match=r"000000.ply: it has no column rnge_m; it has x_m, y_m,"):
        Frames(made, kind="lidar", columns=["rnge_m"])[0]
    with pytest.raises(
        Error, match=r"000000.exr: it has no channel radiance_w_m2_sr; it has label"
    ):
        Frames(made, kind="camera", channels=["radiance_w_m2_sr"])[0]


def test_missing_damaged_and_other_indexes_are_reported(own, tmp_path):
    data = own.read_bytes()
    with pytest.raises(Error, match=r"none.parquet: there is no such file; make it with ground"):
        Frames(tmp_path / "none.parquet")
    for spoiled in (b"", data[:-1], data[: len(data) // 2], b"PAR1" + data[:50] + b"PAR1"):
        own.write_bytes(spoiled)
        with pytest.raises(Error, match=r"index.parquet: cannot read it as Parquet: .* damaged"):
            Frames(own)
    own.write_bytes(data[:100] + b"\xff" * (len(data) // 2) + data[100 + len(data) // 2 :])
    with pytest.raises(Error, match=r"index.parquet: .*; is it damaged\? Make it again"):
        Frames(own)
    own.write_bytes(data)
    table = parquet.read_table(own)
    parquet.write_table(table.replace_schema_metadata({}), own)
    with pytest.raises(Error, match=r"it is not an index of groundray-index; give the file of"):
        Frames(own)
    facts = {"version": 2, "classes": []}
    parquet.write_table(table.replace_schema_metadata({"groundray_index": json.dumps(facts)}), own)
    with pytest.raises(Error, match=r"it is an index of version 2, but this groundray reads 1: "):
        Frames(own)


def test_an_index_without_splits_has_none(own):
    with pytest.raises(Error, match=r"its frames are not split; make it again with .* --split"):
        Frames(own, "train")
    assert len(Frames(own)) == 8


def test_frames_that_changed_since_are_reported(own):
    folder = own.parent / "data/000001"
    scans = Frames(own, kind="lidar")
    (number,) = (i for i in range(4) if scans.row(i)["files"][".ply"].endswith("1.ply") and i > 1)
    scan = folder / "lidar/top/000001.ply"
    data = scan.read_bytes()
    other = folder.parent / "000000/lidar/top/000000.ply"
    for spoiled, rule in (
        (data[:-1], "its header requires"),
        (other.read_bytes(), "points, but the index states"),
        (data[:100], "is it damaged?"),
    ):
        scan.write_bytes(spoiled)
        with pytest.raises(Error, match=r"lidar/top/000001.ply: ") as raised:
            scans[number]
        assert rule in str(raised.value)
    scan.unlink()
    with pytest.raises(Error, match=r"000001.ply: cannot read it: No such file .* removed"):
        scans[number]
    images = Frames(own, kind="camera")
    for ending in (".png", ".exr"):
        image = folder / f"camera/eye/000000{ending}"
        whole = image.read_bytes()
        image.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(Error, match=rf"000000{ending}: .*damaged"):
            images[2]
        image.write_bytes(whole)
    assert "picture" in images[2]
    shutil.rmtree(folder)
    with pytest.raises(Error, match=r"000001: there is no such dataset, but .* lists it; was it"):
        images[2]


def test_tensors_equal_the_arrays_with_any_number_of_workers(made):
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    frames = Frames(made, "train", kind="camera", channels=["picture", "label", "depth_m"])
    dataset = frames.torch()
    assert isinstance(dataset, torch.utils.data.Dataset)
    assert len(dataset) == len(frames)
    for workers in (0, 2):
        loader = torch.utils.data.DataLoader(dataset, batch_size=2, num_workers=workers)
        read = {name: torch.cat([each[name] for each in loader]) for name in frames[0]}
        assert (
            read["picture"].dtype
            == {8: torch.uint8, 16: torch.int32}[8 * frames[0]["picture"].itemsize]
        )
        assert read["label"].dtype == read["class_id"].dtype == torch.int64
        for name, tensors in read.items():
            expected = np.stack([frames[i][name] for i in range(len(frames))])
            np.testing.assert_array_equal(tensors.numpy(), expected)
    scans = Frames(made, kind="lidar").torch()
    for batch in torch.utils.data.DataLoader(scans, batch_size=3, collate_fn=list, num_workers=2):
        assert all(len(scan["x_m"]) == len(scan["label"]) for scan in batch)


def test_tensors_need_torch(made, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(Error, match=r"a dataset of tensors needs torch, which is not installed"):
        Frames(made).torch()
