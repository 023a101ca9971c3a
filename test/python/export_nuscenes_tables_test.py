"""Tables of nuScenes folders: their keys, chains and files, by the words of the schema."""

from itertools import pairwise

import numpy as np
import pytest
from detection_runs import boxed_folder, mount_of, pinhole_of, pose_of
from nuscenes_readers import (
    CHANNELS,
    KEYS,
    PLACE_M,
    VERSION,
    Own,
    channel_of,
    frame_of,
    nuscenes_folder,
)


@pytest.fixture(scope="module")
def own():
    return Own(nuscenes_folder())


def test_every_token_is_unique_and_every_key_leads_to_a_row(own):
    tokens = [row["token"] for name in KEYS for row in own.rows[name]]
    assert len(set(tokens)) == len(tokens)
    for name, keys in KEYS.items():
        assert own.rows[name], name
        assert len({frozenset(row) for row in own.rows[name]}) == 1
        for row in own.rows[name]:
            for field, table in keys.items():
                value = row[field]
                for token in value if isinstance(value, list) else [value]:
                    assert token in own.by_token[table] or (
                        token == "" and field in ("prev", "next")
                    ), (name, field)


def chains_of(rows):
    """Follows next from each first row; returns the chains."""
    by_token = {row["token"]: row for row in rows}
    chains = []
    for row in (row for row in rows if not row["prev"]):
        chain = [row]
        while chain[-1]["next"]:
            following = by_token[chain[-1]["next"]]
            assert following["prev"] == chain[-1]["token"]
            chain.append(following)
        chains.append(chain)
    assert sum(map(len, chains)) == len(rows)  # no row is outside of all, or in a circle
    return chains


def test_chains_are_complete_and_in_order_of_time(own):
    (scene,) = own.rows["scene"]
    (samples,) = chains_of(own.rows["sample"])
    assert scene["nbr_samples"] == len(samples) == 4
    assert scene["first_sample_token"] == samples[0]["token"]
    assert scene["last_sample_token"] == samples[-1]["token"]
    for before, after in pairwise(samples):
        assert 297_000 <= after["timestamp"] - before["timestamp"] < 400_000
    order = {row["token"]: i for i, row in enumerate(samples)}
    chains = chains_of(own.rows["sample_data"])
    assert len(chains) == len(CHANNELS)
    for chain in chains:
        assert len({row["calibrated_sensor_token"] for row in chain}) == 1
        assert all(a["timestamp"] < b["timestamp"] for a, b in pairwise(chain))
        keys = [order[row["sample_token"]] for row in chain if row["is_key_frame"]]
        assert keys == list(range(4))
        for row in chain:
            sample = samples[order[row["sample_token"]]]
            if row["is_key_frame"]:
                nearest = min(abs(each["timestamp"] - sample["timestamp"]) for each in chain)
                assert abs(row["timestamp"] - sample["timestamp"]) == nearest
            elif sample is not samples[-1]:  # it belongs to the sample that follows it
                assert row["timestamp"] <= sample["timestamp"]
                before = samples[order[row["sample_token"]] - 1]
                assert row["timestamp"] > before["timestamp"]
    chains = {
        chain[0]["instance_token"]: chain for chain in chains_of(own.rows["sample_annotation"])
    }
    assert set(chains) == set(own.by_token["instance"])
    for token, chain in chains.items():
        instance = own.get("instance", token)
        assert {row["instance_token"] for row in chain} == {token}
        assert instance["nbr_annotations"] == len(chain)
        assert instance["first_annotation_token"] == chain[0]["token"]
        assert instance["last_annotation_token"] == chain[-1]["token"]
        places = [order[row["sample_token"]] for row in chain]
        assert places == sorted(set(places))


def test_files_are_those_of_the_tables(own):
    listed = {row["filename"] for row in own.rows["sample_data"] + own.rows["map"]}
    listed |= {f"{VERSION}/{name}.json" for name in (*KEYS, "splits")}
    found = {p.relative_to(own.out).as_posix() for p in own.out.rglob("*") if p.is_file()}
    assert found == listed
    for data in own.rows["sample_data"]:
        assert data["filename"].startswith("samples/" if data["is_key_frame"] else "sweeps/")
        assert data["filename"].split("/")[1] == channel_of(own, data)
        sensor, frame = frame_of(own, data)
        if sensor in ("left", "right"):
            recorded = boxed_folder() / f"camera/{sensor}/{frame:06}.png"
            assert (own.out / data["filename"]).read_bytes() == recorded.read_bytes()
            assert (data["width"], data["height"], data["fileformat"]) == (96, 72, "png")
        else:
            assert (data["width"], data["height"], data["fileformat"]) == (0, 0, "pcd")


def test_calibration_and_poses_are_those_of_the_dataset(own):
    for mount in own.rows["calibrated_sensor"]:
        sensor = CHANNELS[own.get("sensor", mount["sensor_token"])["channel"]]
        np.testing.assert_allclose(own.pose(mount), mount_of(sensor), atol=1e-12)
        if sensor in ("left", "right"):
            K = np.array(mount["camera_intrinsic"])
            np.testing.assert_allclose(K, pinhole_of(sensor), rtol=1e-12)
        else:
            assert mount["camera_intrinsic"] == []
    for data in own.rows["sample_data"]:
        ego = own.get("ego_pose", data["ego_pose_token"])
        assert ego["timestamp"] == data["timestamp"]
        sensor, _ = frame_of(own, data)
        X_DS = pose_of(sensor, data["timestamp"] * 1e-6)
        np.testing.assert_allclose(own.sensor_pose(data), X_DS, atol=PLACE_M)
