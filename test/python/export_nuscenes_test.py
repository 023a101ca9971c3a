"""nuScenes folders, read by nuscenes-devkit, and by the words of its schema."""

import functools
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from detection_runs import (
    boxed_folder,
    corners_of_box,
    half_of_box,
    moved,
    pinhole_of,
    pose_of,
    pose_of_box,
    projected,
    scan_of,
    speed,
    stamps_s,
)
from export_runs import export, fails, names_in, run_folder, still, world_of
from nuscenes_readers import (
    MIDDLE_S,
    PLACE_M,
    Devkit,
    Own,
    annotations_of,
    nuscenes_folder,
    sample_frames,
    tables_of,
)

NAMES = {
    4: "static.other",
    6: "static.vegetation",
    10: "vehicle.car",
    11: "human.pedestrian.adult",
}


@functools.cache
def read_by(kind):
    return kind(nuscenes_folder())


@pytest.fixture(params=[Own, Devkit])
def reader(request):
    return read_by(request.param)


@pytest.fixture
def own():
    return read_by(Own)


def test_corners_lie_where_the_dataset_places_them(reader):
    checked = 0
    for sample, time_s, keys in sample_frames(reader):
        boxes, _ = tables_of(keys)
        annotations = annotations_of(reader, sample)
        assert set(annotations) == set(boxes)
        for instance, annotation in annotations.items():
            row, begin_s = boxes[instance]
            in_world = corners_of_box(row, time_s - begin_s)
            for sensor in ("top", "left"):
                data, frame = keys[sensor]
                at_s = stamps_s(sensor)[frame] + (MIDDLE_S if sensor == "left" else 0)
                expected = moved(np.linalg.inv(pose_of(sensor, at_s)), in_world)
                corners = reader.corners(data, annotation)
                # Angles of the slerp differ by 1e-5 or less.
                atol = PLACE_M + 1e-5 * np.linalg.norm(expected, axis=1).max()
                np.testing.assert_allclose(corners, expected, atol=atol)
                if sensor == "left" and expected[:, 2].min() > 3:
                    mount = reader.get("calibrated_sensor", data["calibrated_sensor_token"])
                    in_image = projected(np.array(mount["camera_intrinsic"]), corners)
                    in_picture = projected(pinhole_of("left"), expected)
                    # 66 px a radian: 3e-4 m at 3 m, and the angle of 1e-5.
                    np.testing.assert_allclose(in_image, in_picture, atol=0.03)
                    checked += 1
    assert checked > 50


def test_velocities_are_differences_of_poses(reader):
    centres, speeds = {}, {}
    for sample, time_s, keys in sample_frames(reader):
        boxes, _ = tables_of(keys)
        for instance, annotation in annotations_of(reader, sample).items():
            row, begin_s = boxes[instance]
            centre = pose_of_box(row, time_s - begin_s)[:3, 3]
            centres.setdefault(instance, []).append((time_s, centre, annotation))
            speeds.setdefault(instance, []).append(row)
    moving = 0
    for instance, track in centres.items():
        for i, (_, _, annotation) in enumerate(track):
            first, last = track[max(i - 1, 0)], track[min(i + 1, len(track) - 1)]
            velocity = reader.velocity(annotation["token"])
            if first[0] == last[0]:
                assert np.isnan(velocity).all()
                continue
            expected = (last[1] - first[1]) / (last[0] - first[0])
            # Times are rounded to microseconds: half of one at 6 m/s, twice, in 0.3 s.
            np.testing.assert_allclose(velocity, expected, rtol=1e-5, atol=2e-5)
            row = speeds[instance][i]
            if row["label"] in (4, 6):
                assert not velocity.any()
            else:  # the car turns and pitches, as in boxes_test.py
                stated = np.array([row[f"v{k}_m_s"] for k in "xyz"])
                assert np.linalg.norm(velocity - stated) < (1.5 if row["label"] == 10 else 0.5)
                moving += 1
    assert moving >= 4


def test_points_are_placed_by_the_poses_and_lie_in_boxes(reader):
    checked = 0
    for sample, time_s, keys in sample_frames(reader):
        boxes, _ = tables_of(keys)
        annotations = annotations_of(reader, sample)
        counts = dict.fromkeys(annotations, 0)
        for sensor in ("top", "front"):
            data, frame = keys[sensor]
            rows = scan_of(sensor, frame)
            points = reader.points(data)
            np.testing.assert_allclose(points[:, 3], 255 * rows["intensity"], rtol=1e-6)
            raw = np.fromfile(reader.out / data["filename"], np.float32).reshape(-1, 5)
            np.testing.assert_array_equal(raw[:, 4], rows["ring"])
            in_world = moved(reader.sensor_pose(data), points[:, :3].astype(float))
            np.testing.assert_allclose(
                in_world[still(rows)], world_of(rows)[still(rows)], atol=PLACE_M
            )
            begin_s = stamps_s(sensor)[frame]
            for instance, annotation in annotations.items():
                own = np.flatnonzero(rows["instance"] == instance)
                counts[instance] += len(own)
                if sensor == "front" or not len(own):
                    continue
                row, _ = boxes[instance]
                in_box = moved(np.linalg.inv(reader.pose(annotation)), in_world[own])
                off_m = (np.abs(in_box) - half_of_box(row)).max(axis=1)
                # Limbs are up to three times as fast as the body.
                apart_s = np.abs(rows["time"][own] + begin_s - time_s)
                assert np.all(off_m <= 3 * speed(row) * apart_s + PLACE_M)
                checked += len(own)
        for instance, annotation in annotations.items():
            assert annotation["num_lidar_pts"] == counts[instance]
            assert annotation["num_radar_pts"] == 0
    assert checked > 1000


def test_levels_of_visibility_and_attributes_are_those_of_the_boxes(own):
    levels = {row["token"]: row["level"] for row in own.rows["visibility"]}
    names = {row["token"]: row["name"] for row in own.rows["attribute"]}
    used, attributes = set(), {}
    for sample, _, keys in sample_frames(own):
        boxes, seen = tables_of(keys)
        for instance, annotation in annotations_of(own, sample).items():
            row, _ = boxes[instance]
            share = 0.0
            for image in seen.get(instance, []):
                # b / (b + alone) is the share beside the image.
                beside = image["alone"] / (1 - image["truncated_share"]) - image["alone"]
                share = max(share, image["pixels"] / (image["alone"] + beside))
            low, high = (
                int(n) / 100 for n in levels[annotation["visibility_token"]][1:].split("-")
            )
            assert low - 1e-12 <= share <= high + 1e-12
            used.add(annotation["visibility_token"])
            category = own.get(
                "category", own.get("instance", annotation["instance_token"])["category_token"]
            )
            assert category["name"] == NAMES[row["label"]]
            for token in annotation["attribute_tokens"]:
                attributes.setdefault(category["name"], set()).add(names[token])
    assert used == {"1", "2", "3", "4"}
    assert attributes == {
        "vehicle.car": {"vehicle.moving"},
        "human.pedestrian.adult": {"pedestrian.moving"},
    }


def test_the_devkits_evaluation_reads_boxes_and_the_split():
    kit = read_by(Devkit).kit
    from nuscenes.eval.common.loaders import load_gt_of_sample_tokens
    from nuscenes.eval.detection.data_classes import DetectionBox
    from nuscenes.utils.splits import get_scenes_of_split

    assert get_scenes_of_split("groundray", kit) == ["scene-0000"]
    tokens = [row["token"] for row in kit.sample]
    truth = load_gt_of_sample_tokens(kit, tokens, DetectionBox)
    found = [box for token in tokens for box in truth[token]]
    assert {box.detection_name for box in found} == {"car", "pedestrian"}
    assert {box.attribute_name for box in found} == {"vehicle.moving", "pedestrian.moving"}


def test_nuscenes_own_evaluation_finds_no_error_in_the_truth(tmp_path):
    kit = read_by(Devkit).kit
    from nuscenes.eval.detection.config import config_factory
    from nuscenes.eval.detection.evaluate import DetectionEval
    from nuscenes.eval.detection.utils import category_to_detection_name

    names = {row["token"]: row["name"] for row in kit.attribute}
    results = {sample["token"]: [] for sample in kit.sample}
    for row in kit.sample_annotation:
        kind = category_to_detection_name(row["category_name"])
        if kind is not None:
            results[row["sample_token"]].append(
                {
                    **{
                        key: row[key] for key in ("sample_token", "translation", "size", "rotation")
                    },
                    "velocity": kit.box_velocity(row["token"])[:2].tolist(),
                    "detection_name": kind,
                    "detection_score": 0.9,
                    "attribute_name": names[row["attribute_tokens"][0]],
                }
            )
    used = {f"use_{kind}": kind == "lidar" for kind in ("camera", "lidar", "radar", "map")}
    record = {"meta": {**used, "use_external": False}, "results": results}
    (tmp_path / "found.json").write_text(json.dumps(record))
    settings = config_factory("detection_cvpr_2019")
    rating = DetectionEval(
        kit, settings, str(tmp_path / "found.json"), "groundray", str(tmp_path), verbose=False
    )
    metrics, _ = rating.evaluate()
    for kind in ("car", "pedestrian"):
        for threshold_m in settings.dist_ths:
            assert metrics.get_label_ap(kind, threshold_m) == pytest.approx(1)
        for error in ("trans_err", "scale_err", "orient_err", "vel_err", "attr_err"):
            assert metrics.get_label_tp(kind, error) == pytest.approx(0, abs=1e-6)


def test_without_images_visibility_is_unknown(tmp_path, capsys):
    options = ["--no-images", "--sequence", "7", "--lidar", "top"]
    assert export("nuscenes", tmp_path / "out", *options, source=boxed_folder()) == 0
    own = Own(tmp_path / "out")
    assert {row["channel"] for row in own.rows["sensor"]} == {"LIDAR_TOP"}
    assert {row["visibility_token"] for row in own.rows["sample_annotation"]} == {""}
    assert own.rows["scene"][0]["name"] == "scene-0007"
    assert len(own.rows["sample"]) == 3  # half a second apart
    assert names_in(tmp_path / "out/sweeps") == ["LIDAR_TOP"]


def test_a_set_of_labels_gives_the_categories(tmp_path, capsys):
    options = ["--labels", "cityscapes", "--boxes-of", "vehicle,person"]
    run = shutil.copytree(boxed_folder(), tmp_path / "run")
    record = run / "dataset.yaml"
    record.write_text(record.read_text().replace("11: person", "11: animal"))
    assert export("nuscenes", tmp_path / "none", *options, source=run) == 1
    assert "--boxes-of person: it is no class or label of an object" in capsys.readouterr().err
    options[-1] = "vehicle,11"
    assert export("nuscenes", tmp_path / "out", *options, source=run) == 0
    assert "has no category for animal: it is added as number 34" in capsys.readouterr().out
    own = Own(tmp_path / "out")
    used = {own.get("category", row["category_token"])["name"] for row in own.rows["instance"]}
    assert used == {"car", "animal"}


def test_a_dataset_without_boxes_has_one_message(tmp_path, capsys):
    run = shutil.copytree(run_folder(), tmp_path / "run")
    line = fails(capsys, run, "nuscenes", "--camera", "left")
    assert (
        "it has neither scans nor pictures with boxes, which nuscenes needs; set boxes: rep" in line
    )


def test_times_are_those_of_the_clock_of_the_dataset(tmp_path, capsys):
    run = shutil.copytree(boxed_folder(), tmp_path / "run")
    text = (run / "dataset.yaml").read_text()
    later = text.replace("time_origin_s: 0.000000000", "time_origin_s: 1782057600.250000001", 1)
    assert later != text
    (run / "dataset.yaml").write_text(later)
    assert export("nuscenes", tmp_path / "out", source=run) == 0
    own = Own(tmp_path / "out")
    assert own.rows["log"][0]["date_captured"] == "2026-06-21"
    # Ten scans a second, and two samples.
    for row, stamp_s in zip(own.rows["sample"], stamps_s("top")[::5], strict=True):
        nanoseconds = 1782057600250000001 + round(stamp_s * 1e9)
        assert row["timestamp"] == (nanoseconds + 500) // 1000


def test_stamps_that_do_not_increase_have_one_message(tmp_path, capsys):
    run = shutil.copytree(boxed_folder(), tmp_path / "run")
    text = (run / "dataset.yaml").read_text()
    stamps = [f"frame: {i}, stamp_s: {stamps_s('left')[i]:.9f}" for i in (3, 4)]
    assert all(text.count(f'sensor: "left", {each}') == 1 for each in stamps)
    same = text.replace(f'"left", {stamps[1]}', f'"left", frame: 4, stamp_s: {stamps_s("left")[3]}')
    (run / "dataset.yaml").write_text(same)
    line = fails(capsys, run, "nuscenes")
    assert "the stamps of left do not increase by microseconds; was it edited?" in line


def test_two_sensors_of_one_channel_have_one_message(tmp_path):
    from groundray.dataset import Dataset, Error
    from groundray.export.boxes import BoxChoice
    from groundray.export.categories import Categories
    from groundray.export.notes import Notes
    from groundray.export.nuscenes import NuscenesOptions, write_nuscenes
    from groundray.export.scan import FullScale

    data = Dataset(boxed_folder())
    lidars = [data.lidars[0], replace(data.lidars[1], name="TOP")]
    categories = Categories(data, None, Notes())
    options = NuscenesOptions(FullScale(None), categories, BoxChoice(data, None), 0, 10**9)
    with pytest.raises(Error, match="two of its sensors would be the channel LIDAR_TOP; choose"):
        write_nuscenes(data, lidars, [], options, tmp_path, Notes())
