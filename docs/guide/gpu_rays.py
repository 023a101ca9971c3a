"""Trace the rays of a folder of `groundray-golden passes` on a GPU, in single precision.

usage: gpu_rays.py PASSES THEIRS

The tracer is as simple as can be: each work item tests one ray against all triangles.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pyopencl as cl

KERNEL = """
kernel void trace(global const float *rays, global const float *corners, int triangles,
                  global float *range_m, global int *triangle) {
  const int i = get_global_id(0);
  const float3 origin = vload3(2 * i, rays), direction = vload3(2 * i + 1, rays);
  float nearest = INFINITY;
  int hit = -1;
  for (int k = 0; k < triangles; ++k) {
    const float3 a = vload3(3 * k, corners) - origin;
    const float3 ab = vload3(3 * k + 1, corners) - origin - a;
    const float3 ac = vload3(3 * k + 2, corners) - origin - a;
    const float3 normal = cross(ab, ac);
    const float falls = -dot(normal, direction);
    if (!(falls > 0)) continue;  /* only from above */
    const float t = -dot(normal, a) / falls;
    const float3 side = cross(direction, a);
    const float u = dot(side, ac) / falls, v = -dot(side, ab) / falls;
    const float rim = 1e-5f;  /* so that no ray passes between two triangles */
    if (t >= 0 && t < nearest && u >= -rim && v >= -rim && u + v <= 1 + rim) {
      nearest = t;
      hit = k;
    }
  }
  range_m[i] = nearest;
  triangle[i] = hit;
}
"""


def corners_of(passes: Path) -> np.ndarray:
    """Returns the corners of all triangles in D, metres: (n, 3, 3)."""
    dem = json.loads((passes / "manifest.json").read_text())["dem"]
    at = np.load(passes / "mesh/vertices.npy")  # column and row
    points = np.empty((len(at), 3))
    points[:, :2] = np.array(dem["origin_m"]) + at * np.array(dem["step_m"])
    points[:, 2] = np.load(passes / "heights_m.npy")[at[:, 1], at[:, 0]]
    return points[np.load(passes / "mesh/triangles.npy")]


def trace(passes: Path) -> tuple[np.ndarray, np.ndarray, str]:
    """Returns ranges, triangles and the device's name."""
    context = cl.create_some_context(interactive=False)
    queue = cl.CommandQueue(context)
    rays = np.stack([np.load(passes / f"rays/{name}.npy") for name in ("origin_m", "direction")], 1)
    corners = corners_of(passes)
    flags = cl.mem_flags
    read, write = flags.READ_ONLY | flags.COPY_HOST_PTR, flags.WRITE_ONLY
    given = [cl.Buffer(context, read, hostbuf=x.astype("f4")) for x in (rays, corners)]
    range_m, triangle = np.empty(len(rays), "f4"), np.empty(len(rays), "i4")
    found = [cl.Buffer(context, write, x.nbytes) for x in (range_m, triangle)]
    kernel = cl.Kernel(cl.Program(context, KERNEL).build(), "trace")
    kernel(queue, (len(rays),), None, *given, np.int32(len(corners)), *found)
    cl.enqueue_copy(queue, range_m, found[0])
    cl.enqueue_copy(queue, triangle, found[1])
    return range_m, triangle, context.devices[0].name


def main() -> None:
    passes, theirs = map(Path, sys.argv[1:])
    range_m, triangle, device = trace(passes)
    (theirs / "rays").mkdir(parents=True)
    np.save(theirs / "rays/range_m.npy", range_m)
    np.save(theirs / "rays/triangle.npy", triangle)
    # Rounding a position to float moves a ray by some units in the last place of the largest.
    farthest_m = float(np.abs(corners_of(passes)).max())
    claims = {
        "implementation": f"gpu_rays.py on {device}",
        "classes": ["rays"],
        "rays": {
            "precision": "float",
            "delta_m": 32 * 2**-24 * farthest_m,
            "range_relative": 1e-6,
            "range_absolute_m": 32 * 2**-24 * farthest_m,
        },
    }
    (theirs / "manifest.json").write_text(json.dumps(claims, indent=2))


if __name__ == "__main__":
    main()
