"""Datasets of chosen sensors and frames, as the package reads and exports them."""

from dataset_runs import generate
from groundray.dataset import Dataset
from groundray.export.command import main


def test_a_dataset_of_chosen_frames_is_complete(tmp_path):
    result = generate(tmp_path, "--sensor", "front,eye", "--frames", "1:")
    assert result.returncode == 0, result.stderr
    dataset = Dataset(tmp_path / "out")
    assert dataset.pending == 0
    assert [(lidar.name, lidar.number) for lidar in dataset.lidars] == [("front", 1)]
    assert [(camera.name, camera.number) for camera in dataset.cameras] == [("eye", 2)]
    for sensor in (dataset.lidars[0], dataset.cameras[0]):
        assert [frame.number for frame in sensor.frames] == [1, 2]
    assert main([str(tmp_path / "out"), "--to", "npz", "-o", str(tmp_path / "npz")]) == 0
    assert len(list((tmp_path / "npz").rglob("*.npz"))) == 2
