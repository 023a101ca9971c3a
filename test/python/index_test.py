"""groundray-index: rows and counts equal those of the files, read by other software."""

import hashlib
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml
from export_runs import names_in
from index_runs import WORLDS, index, worlds_folder

parquet = pytest.importorskip("pyarrow.parquet")

SPLIT = ("--split", "train=0.5,validation=0.25,test=0.25")
NAMES = {0: "nothing", 1: "ground", 2: "grass", 4: "label 4", 7: "rock", 10: "vehicle"}


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """An index of all worlds, with splits."""
    out = tmp_path_factory.mktemp("index") / "index.parquet"
    assert index(out, *SPLIT, "--seed", "3") == 0
    return out


@pytest.fixture(scope="module")
def rows(made):
    return parquet.read_table(made).to_pylist()


def record_of(world: int):
    return yaml.safe_load((worlds_folder() / f"{world:06}/dataset.yaml").read_text())


def labels_in(file: Path):
    """Returns labels and instances of a scan by plyfile, or of an image by OpenEXR."""
    if file.suffix == ".ply":
        import plyfile

        data = plyfile.PlyData.read(file)["vertex"].data
        return data["label"], data["instance"]
    import OpenEXR

    with OpenEXR.File(str(file), separate_channels=True) as image:
        channels = image.channels()
        seen = channels["Valid"].pixels == 1
        return channels["Label"].pixels[seen], channels["Instance"].pixels[seen]


def test_each_frame_of_each_sensor_has_a_row(rows):
    expected = []
    for world in range(WORLDS):
        record = record_of(world)
        expected += [(world, each["sensor"], each["frame"]) for each in record["frames"]]
    assert sorted((row["world"], row["sensor"], row["frame"]) for row in rows) == sorted(expected)
    assert len(rows) > 2 * WORLDS


def test_rows_state_the_values_drawn_and_the_frames(rows, made):
    for row in rows:
        record = record_of(row["world"])
        assert (made.parent / row["dataset"]).resolve() == (
            worlds_folder() / f"{row['world']:06}"
        ).resolve()
        drawn = {key.removeprefix("drawn."): row[key] for key in row if key.startswith("drawn.")}
        assert drawn == record["drawn"]
        assert row["seed"] == record["seed"]
        assert row["labels"] == sorted(record["classes"].items())
        (frame,) = (
            each
            for each in record["frames"]
            if (each["sensor"], each["frame"]) == (row["sensor"], row["frame"])
        )
        assert row["stamp_ns"] == round(frame["stamp_s"] * 1e9)
        listed = dict(row["files"])
        assert set(listed) == set(frame["files"])
        for ending, file in listed.items():
            size = (made.parent / row["dataset"] / file).stat().st_size
            assert size == frame["files"][ending]["bytes"]
        (sensor,) = (each for each in record["sensors"] if each["name"] == row["sensor"])
        assert (row["kind"], row["model"]) == (sensor["kind"], sensor["model"])
        assert row["origin_w_m"] == record["origin_w_m"]
    types = {name: str(kind) for name, kind in zip(rows[0], _types(made), strict=True)}
    assert types["drawn.objects.car"] == "bool"
    assert types["drawn.objects.rock.variant"] == "int64"
    assert types["drawn.sky.sun.elevation_deg"] == "double"
    assert types["drawn.terrain.material"] == "string"


def _types(made):
    return parquet.read_schema(made).types


def test_counts_are_those_of_other_readers(rows, made):
    seen = Counter()
    for row in rows:
        files = dict(row["files"])
        file = made.parent / row["dataset"] / files.get(".ply", files.get(".exr"))
        labels, instances = labels_in(file)
        assert row["points" if row["kind"] == "lidar" else "pixels"] == len(labels)
        assert row["pixels" if row["kind"] == "lidar" else "points"] is None
        counts = {NAMES[label]: int((labels == label).sum()) for label in set(labels.tolist())}
        assert dict(row["classes"]) == counts
        pairs = Counter(zip(instances.tolist(), labels.tolist(), strict=True))
        expected = [
            {"instance": instance, "label": label, "count": count}
            for (instance, label), count in sorted(pairs.items())
            if instance
        ]
        assert row["instances"] == expected
        seen += Counter(counts)
    assert set(seen) == set(NAMES.values())


def test_poses_are_those_of_the_paths(rows, made):
    from scipy.spatial.transform import Rotation, Slerp

    for row in rows:
        folder = made.parent / row["dataset"]
        table = np.loadtxt(folder / f"poses/{row['sensor']}.tum")
        time_s = row["stamp_ns"] * 1e-9
        if row["kind"] == "camera":
            camera = yaml.safe_load((folder / f"calibration/{row['sensor']}.yaml").read_text())
            assert [row["width_px"], row["height_px"]] == camera["size_px"]
            rows_s = camera["row_s"] * (row["height_px"] - 1)
            time_s += (camera["exposure_s"] + rows_s) / 2
        assert row["pose_ns"] * 1e-9 == pytest.approx(time_s, abs=1e-9)
        place = [np.interp(time_s, table[:, 0], table[:, i]) for i in (1, 2, 3)]
        # Constant twist and linear interpolation differ by 1/8 of turn times step between samples.
        assert [row[f"{axis}_m"] for axis in "xyz"] == pytest.approx(place, abs=1e-4)
        turn = Slerp(table[:, 0], Rotation.from_quat(table[:, 4:]))(time_s)
        mine = Rotation.from_quat([row[f"q{axis}"] for axis in "xyzw"])
        assert (turn * mine.inv()).magnitude() < 1e-6


def test_worlds_of_one_scene_share_its_hash_and_frames_of_one_world_a_split(rows, made):
    assert len({row["scene"] for row in rows}) == 1
    split = {row["world"]: row["split"] for row in rows}
    assert all(split[row["world"]] == row["split"] for row in rows)
    # The documented rule, once more: sorted hashes, then shares 3, 1.5 and 1.5 rounded.
    scene = rows[0]["scene"]
    order = sorted(
        range(WORLDS), key=lambda world: hashlib.sha256(f"3 {scene} {world}".encode()).digest()
    )
    assert [split[world] for world in order] == [
        *["train"] * 3,
        *["validation"] * 2,
        *["test"] * 1,
    ]
    facts = json.loads(parquet.read_metadata(made).metadata[b"groundray_index"])
    assert facts == {
        "version": 1,
        "classes": ["nothing", "grass", "ground", "label 4", "rock", "vehicle"],
        "splits": {"train": 0.5, "validation": 0.25, "test": 0.25},
        "seed": 3,
    }


def test_equal_datasets_give_equal_bytes_in_any_order(made, tmp_path, capsys):
    folders = sorted(worlds_folder().iterdir())
    again = made.with_name("again.parquet")
    options = [*SPLIT, "--report", tmp_path / "a.html"]
    doubled = [folders[3], worlds_folder(), *reversed(folders)]
    assert index(again, *options, "--seed", "3", source=doubled) == 0
    assert capsys.readouterr().out == (
        f"{again}: {4 * WORLDS} frames of 6 datasets, 6 worlds: train 3, validation 2, test 1\n"
    )
    assert again.read_bytes() == made.read_bytes()
    page = (tmp_path / "a.html").read_bytes()
    assert index(again, *options, "--seed", "3", source=folders) == 0
    assert again.read_bytes() == made.read_bytes()
    assert (tmp_path / "a.html").read_bytes() == page
    assert index(again, *options, source=folders) == 0
    assert again.read_bytes() != made.read_bytes()  # of another seed
    again.unlink()
    assert names_in(tmp_path) == ["a.html"]


def test_without_splits_the_column_is_empty(tmp_path):
    assert index(tmp_path / "index.parquet") == 0
    assert set(parquet.read_table(tmp_path / "index.parquet")["split"].to_pylist()) == {None}
