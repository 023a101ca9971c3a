"""Ground truth of lidars and cameras on robots in rough terrain.

    import groundray

    scan = groundray.load_scene("trail.yaml").lidar("roof").scan(t_s=0.0)
    scan["range_true_m"]

Results are NumPy arrays that view groundray's own memory; names end in their units (see
docs/guide/python.md).
"""

from groundray._core import (
    Camera,
    Error,
    FusedDem,
    Image,
    Lidar,
    Mesh,
    Points,
    Scan,
    Scene,
    Terrain,
    Worlds,
    compare,
    fill_dem,
    fill_holes,
    fuse_dem,
    fuse_points,
    load_mesh,
    load_points,
    load_scene,
    load_terrain,
    reconstruct_mesh,
    simplify,
    smooth_dem,
    version,
)
from groundray._scene import scene

__version__ = version

__all__ = [
    "Camera",
    "Error",
    "FusedDem",
    "Image",
    "Lidar",
    "Mesh",
    "Points",
    "Scan",
    "Scene",
    "Terrain",
    "Worlds",
    "__version__",
    "compare",
    "fill_dem",
    "fill_holes",
    "fuse_dem",
    "fuse_points",
    "load_mesh",
    "load_points",
    "load_scene",
    "load_terrain",
    "reconstruct_mesh",
    "scene",
    "simplify",
    "smooth_dem",
]

for _name in __all__:  # messages and help say groundray.Error, not groundray._core.Error
    if isinstance(globals()[_name], type):
        globals()[_name].__module__ = __name__
del _name
