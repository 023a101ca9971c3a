"""Worlds of the scenes that come with groundray, drawn from the distributions in their files: each
is described without a fault, and makes a scan and a small image in a shard of its own.

`./dev prove` makes 84 worlds of each of the twelve scenes, `./dev test` one of one of them.
"""

import os

import numpy as np
import OpenEXR
import pytest
import yaml
from cluster_runs import CAMERA, ROOT, cluster
from dataset_runs import PROGRAM, groundray
from groundray.dataset import Dataset

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
SCENES = sorted([*ROOT.glob("data/scenes/worlds/*.yaml"), ROOT / "data/scenes/forest_track.yaml"])
COUNT = 84 if IS_FULL else 1
CHOSEN = SCENES if IS_FULL else [path for path in SCENES if path.stem == "desert_wash"]


def small_scene(path, folder):
    """Writes a scene with small images and the lidar's rays alone; returns its path."""
    scene = yaml.safe_load(path.read_text())
    scene["terrain"]["dem"] = str((path.parent / scene["terrain"]["dem"]).resolve())
    mount = {"translation_m": [0, 0, 1.8]}
    scene["lidars"] = [{"name": "top", "preset": "velodyne_vlp16", "mount": mount}]
    camera = scene["cameras"][0]
    sensor = {key: camera[key] for key in ("name", "mount", "trigger")}
    scene["cameras"] = [sensor | {"file": "camera.yaml"}]
    scene.pop("stereo", None)
    (folder / "camera.yaml").write_text(CAMERA)
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    return folder / "scene.yaml"


@pytest.mark.parametrize("path", CHOSEN, ids=lambda path: path.stem)
def test_worlds_of_the_scenes_that_come_with_groundray_are_made(path, tmp_path):
    scene = small_scene(path, tmp_path)
    for world in range(COUNT):
        drawn = tmp_path / f"scene.{world}.yaml"
        for command in (("sample", scene, "--index", world, "-o", drawn), ("info", drawn)):
            result = groundray(*command)
            assert result.returncode == 0, f"{path.stem}, world {world}: {result.stderr}"
    table = tmp_path / "params.yaml"
    table.write_text(f"scene: scene.yaml\nshards: 1\nworlds: {COUNT}\n")
    store = tmp_path / "store"
    given = ["--store", store.as_uri(), "--groundray", PROGRAM, "--workers", 2]
    assert cluster("sweep", table, *given) == 0
    found = set()
    for world in range(COUNT):
        dataset = Dataset(store / f"{world:06}/dataset")
        assert dataset.pending == 0
        (lidar,), (camera,) = dataset.lidars, dataset.cameras
        scan = dataset.scan_file(lidar, lidar.frames[0]).read_bytes()
        image = OpenEXR.File(str(dataset.image_file(camera, camera.frames[0], ".exr")))
        radiance = image.channels()["RGB"].pixels
        assert np.isfinite(radiance).all()
        assert radiance.std() > 0
        (vertices,) = [line for line in scan.split(b"\n", 40) if line.startswith(b"element vertex")]
        assert int(vertices.split()[2]) > 1000
        found.add(scan)
    assert len(found) == COUNT
