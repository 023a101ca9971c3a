"""Functions that pickles of groundray's objects call; each checks the values that it is given."""

from typing import Any

from groundray import _core


def points(state: tuple[Any, ...]) -> _core.Points:
    return _core.restore_points(state)


def scan(state: tuple[Any, ...]) -> _core.Scan:
    return _core.restore_scan(state)


def image(state: tuple[Any, ...]) -> _core.Image:
    return _core.restore_image(state)


def mesh(state: tuple[Any, ...]) -> _core.Mesh:
    return _core.restore_mesh(state)


def terrain(state: tuple[Any, ...]) -> _core.Terrain:
    return _core.restore_terrain(state)


def fused_dem(state: tuple[Any, ...]) -> _core.FusedDem:
    return _core.restore_fused_dem(state)


def scene(state: tuple[Any, ...]) -> _core.Scene:
    return _core.restore_scene(state)


def lidar(state: tuple[Any, ...]) -> _core.Lidar:
    return _core.restore_lidar(state)


def camera(state: tuple[Any, ...]) -> _core.Camera:
    return _core.restore_camera(state)
