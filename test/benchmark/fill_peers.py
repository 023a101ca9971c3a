"""How well blank areas of DEMs are filled, beside other people's ways to do it.

Masks are cut from real and fractal ground: blobs that take 1, 5 and 20 % of it, stripes, and the
shadows of a sensor (by casting rays). Each is filled by groundray, by a thin plate (an own sparse
solve with SciPy), SciPy's radial basis functions (thin plate spline of 64 neighbours), GDAL's
FillNodata, and OpenCV's inpainting by Telea and by Navier-Stokes. Told are the RMSE, groundray's
share of the others', how much of it bounds by lines of sight leave in shadows, and how often errors
are within one and two of groundray's stated standard deviations. Run by `./dev bench fill`;
arguments: how many masks of each kind, DEMs.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import scipy.interpolate
import scipy.ndimage
import scipy.sparse
import scipy.sparse.linalg

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT.parent / "shared/data")) / "dem"
KINDS = ("blob 1 %", "blob 5 %", "blob 20 %", "stripes", "shadows")
DEMS = {
    "jacksboro": (ROOT / "data/terrain/jacksboro.tif", None),
    "prairie": (ROOT / "data/terrain/prairie_1m.tif", None),
    "big tujunga": (SHARED / "bigtujunga_30m/bigtujunga.tif", 32767),
    "moon": (SHARED / "moon_gld100_8193/moon_gld100_8193.tif", None),
    "fractal": (None, None),
}
HOLE = -99999
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)  # tags of GeoTIFFs are new to it


def noise(size: int, random: np.random.Generator, gain) -> np.ndarray:
    """A random field: white noise whose waves of f cycles per cell are multiplied by gain(f)."""
    waves = np.fft.fftfreq(size)
    f = np.hypot(*np.meshgrid(waves, waves))
    f[0, 0] = 1
    gains = gain(f)
    gains[0, 0] = 0
    return np.fft.ifft2(np.fft.fft2(random.standard_normal((size, size))) * gains).real


def load(name: str) -> np.ndarray:
    path, nodata = DEMS[name]
    if path is None:
        field = noise(512, np.random.default_rng(5), lambda f: f**-1.8)
        return 20 * field / field.std()
    heights = cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(float)
    heights[(heights == nodata) | (np.abs(heights) > 1e5)] = np.nan
    return heights


def cut(dem: np.ndarray, random: np.random.Generator, size: int = 192) -> np.ndarray:
    """A square without holes that is not flat."""
    for _ in range(1000):
        row, column = (int(random.integers(0, n - size + 1)) for n in dem.shape)
        part = dem[row : row + size, column : column + size]
        if np.isfinite(part).all() and (np.diff(part) != 0).mean() > 0.5:
            return part.astype(np.float32).astype(float)
    raise RuntimeError("there is no square without holes")


def horizon(heights: np.ndarray, sensor: np.ndarray) -> np.ndarray:
    """How high the line of sight passes that just clears the ground before each sample."""
    size = len(heights)
    y, x = np.mgrid[:size, :size].astype(float)
    dx, dy = x - sensor[0], y - sensor[1]
    distance = np.maximum(np.hypot(dx, dy), 1e-9)
    steepest = np.full(heights.shape, -np.inf)
    for step in range(1, int(distance.max())):
        on = step < distance - 0.75
        px, py = sensor[0] + dx[on] * step / distance[on], sensor[1] + dy[on] * step / distance[on]
        i, j = (np.clip(p.astype(int), 0, size - 2) for p in (px, py))
        a, b = px - i, py - j
        near = heights[j, i] * (1 - a) + heights[j, i + 1] * a
        far = heights[j + 1, i] * (1 - a) + heights[j + 1, i + 1] * a
        steepest[on] = np.maximum(steepest[on], (near * (1 - b) + far * b - sensor[2]) / step)
    return sensor[2] + steepest * distance


def shadows(heights: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """What a sensor does not see, near 15 % of all, and the bounds there."""
    best = None
    relief = np.ptp(heights)
    for _ in range(12):
        x, y = random.uniform(0, len(heights) - 1, 2)
        sensor = np.array([x, y, heights[int(y), int(x)] + relief * random.uniform(0.1, 2)])
        bound = horizon(heights, sensor)
        mask = bound > heights + 1e-6 * relief
        off = abs(np.log((mask.mean() + 1e-4) / 0.15))
        if best is None or off < best[0]:
            best = (off, mask, bound)
    return best[1], best[2]


def enclosed(mask: np.ndarray) -> np.ndarray:
    """The mask without what touches the edge."""
    labels, _ = scipy.ndimage.label(mask, np.ones((3, 3)))
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return mask & ~np.isin(labels, edge[edge > 0])


def make_mask(kind: str, heights: np.ndarray, random: np.random.Generator):
    """Which samples are hidden, and the bounds of these or nothing."""
    size = len(heights)
    if kind == "shadows":
        mask, bound = shadows(heights, random)
        mask = enclosed(mask)
        return mask, np.where(mask, bound, np.nan)
    if kind == "stripes":
        y, x = np.mgrid[:size, :size]
        angle, period = random.uniform(0, np.pi), random.uniform(25, 60)
        across = x * np.cos(angle) + y * np.sin(angle) + random.uniform(0, period)
        mask = across % period < random.uniform(0.08, 0.2) * period
        mask[[0, -1]] = mask[:, [0, -1]] = False
        return mask, None
    share = float(kind.split()[1]) / 100
    width = {0.01: 5, 0.05: 8, 0.2: 9}[share]
    field = noise(size, random, lambda f: np.exp(-2 * (np.pi * f * width) ** 2))
    return enclosed(field > np.quantile(field, 1 - share)), None


def write_grid(path: Path, heights: np.ndarray, cell_m: float = 1) -> None:
    """An ESRI ASCII grid; NaN becomes a hole."""
    rows, columns = heights.shape
    head = f"ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\ncellsize {cell_m}\n"
    with path.open("w") as file:
        file.write(f"{head}NODATA_value {HOLE}\n")
        np.savetxt(file, np.where(np.isnan(heights), HOLE, heights), fmt="%.9g")


def read_tiff(path: Path) -> np.ndarray:
    heights = cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(float)
    return np.where(heights == HOLE, np.nan, heights)


def by_groundray(
    heights: np.ndarray, mask: np.ndarray, *options: object, bound=None, cell_m: float = 1
):
    """Heights, and their sd (with the method of its own)."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_grid(folder / "in.asc", np.where(mask, np.nan, heights), cell_m)
        words = ["--largest-share", 1, "--farthest-m", 1e6, *options]
        if "--method" not in words:
            words += ["--sd-out", folder / "sd.tif"]
        if bound is not None:
            write_grid(folder / "bound.asc", bound, cell_m)
            words += ["--bound", folder / "bound.asc"]
        line = [PROGRAM, "terrain", "fill", folder / "in.asc", "-o", folder / "out.tif", *words]
        run = subprocess.run([str(word) for word in line], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        sd = read_tiff(folder / "sd.tif") if (folder / "sd.tif").exists() else None
        return read_tiff(folder / "out.tif"), sd


def thin_plate(heights: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The least sum of squared second differences, those across twice."""
    rows, columns = heights.shape
    number = np.arange(heights.size).reshape(heights.shape)
    energy = 0
    for stencil, weight in (
        ({(0, 0): 1, (0, 1): -2, (0, 2): 1}, 1),
        ({(0, 0): 1, (1, 0): -2, (2, 0): 1}, 1),
        ({(0, 0): 1, (0, 1): -1, (1, 0): -1, (1, 1): 1}, 2),
    ):
        high = rows - max(r for r, _ in stencil)
        wide = columns - max(c for _, c in stencil)
        terms = scipy.sparse.csr_matrix((high * wide, heights.size))
        for (r, c), factor in stencil.items():
            places = number[r : r + high, c : c + wide].ravel()
            entry = (np.full(places.size, float(factor)), (np.arange(places.size), places))
            terms = terms + scipy.sparse.csr_matrix(entry, shape=terms.shape)
        energy = energy + weight * (terms.T @ terms)
    base = heights[~mask].mean()
    inside = mask.ravel()
    system = energy.tocsr()[inside]
    right = -(system @ np.where(mask, 0, heights - base).ravel())
    filled = heights.copy()
    filled[mask] = base + scipy.sparse.linalg.spsolve(system[:, inside].tocsc(), right)
    return filled


def radial_basis(heights: np.ndarray, mask: np.ndarray) -> np.ndarray:
    rim = scipy.ndimage.binary_dilation(mask, iterations=6) & ~mask
    base = heights[rim].mean()
    filled = heights.copy()
    for neighbours in (64, 128, 512):  # so many as do not lie in one line
        try:
            spline = scipy.interpolate.RBFInterpolator(
                np.argwhere(rim).astype(float), heights[rim] - base, neighbors=neighbours
            )
            filled[mask] = base + spline(np.argwhere(mask).astype(float))
            return filled
        except np.linalg.LinAlgError:
            pass
    raise RuntimeError("no spline of 512 neighbours")


def inpaint(heights: np.ndarray, mask: np.ndarray, method: int) -> np.ndarray:
    holed = np.where(mask, 0, heights).astype(np.float32)
    return cv2.inpaint(holed, mask.astype(np.uint8), 3, method).astype(float)


PEERS = {
    "thin plate": thin_plate,
    "SciPy RBF": radial_basis,
    "GDAL": lambda heights, mask: by_groundray(heights, mask, "--method", "gdal")[0],
    "Telea": lambda heights, mask: inpaint(heights, mask, cv2.INPAINT_TELEA),
    "NS": lambda heights, mask: inpaint(heights, mask, cv2.INPAINT_NS),
}


def compare(dem: np.ndarray, kind: str, seed: int, peers=PEERS, size: int = 192) -> dict | None:
    """Sums of squared errors by method; errors in stated sds; how many samples."""
    random = np.random.default_rng([seed, KINDS.index(kind)])
    heights = cut(dem, random, min(size, *dem.shape))
    mask, bound = make_mask(kind, heights, random)
    if not mask.any():
        return None
    filled, sd = by_groundray(heights, mask)
    results = {"groundray": filled}
    if bound is not None:
        results["bounded"] = by_groundray(heights, mask, bound=bound)[0]
    results |= {name: fill(heights, mask) for name, fill in peers.items()}
    squares = {name: ((z - heights)[mask] ** 2).sum() for name, z in results.items()}
    sds = np.abs((filled - heights)[mask]) / sd[mask]
    return {"squares": squares, "sds": sds, "samples": mask.sum()}


def summarise(runs: list[dict]) -> dict:
    """RMSE by method, and shares of errors within one and two sds."""
    samples = sum(run["samples"] for run in runs)
    names = runs[0]["squares"]
    rmse = {n: np.sqrt(sum(run["squares"][n] for run in runs) / samples) for n in names}
    sds = np.concatenate([run["sds"] for run in runs])
    cover = [(sds <= k).mean() for k in (1, 2)]
    return {"rmse": rmse, "cover": cover}


def main() -> None:
    masks = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    ratios: dict[str, dict[str, list[float]]] = {}
    print(f"{masks} masks of each kind; RMSE in m, then groundray's share of the others'")
    head = "".join(f"{name:>11}" for name in PEERS)
    print(f"{'DEM':12}{'kind':10}{'groundray':>10}{head}{'bounded':>9}{'1 sd':>7}{'2 sd':>6}")
    for name in [n for n in DEMS if not sys.argv[2:] or re.search("|".join(sys.argv[2:]), n)]:
        if DEMS[name][0] is not None and not DEMS[name][0].exists():
            print(f"{name:12}is not there: {DEMS[name][0]}; set GROUNDRAY_SHARED_DATA")
            continue
        dem = load(name)
        for kind in KINDS:
            runs = [run for seed in range(masks) if (run := compare(dem, kind, seed))]
            if not runs:
                continue
            found = summarise(runs)
            own = found["rmse"]["groundray"]
            shares = {n: own / value for n, value in found["rmse"].items() if n in PEERS}
            if "bounded" in found["rmse"]:
                shares["bounded"] = found["rmse"]["bounded"] / own
            for peer, share in shares.items():
                ratios.setdefault(kind, {}).setdefault(peer, []).append(share)
            columns = "".join(f"{shares[peer]:11.3f}" for peer in PEERS)
            bounded = f"{shares['bounded']:9.3f}" if "bounded" in shares else " " * 9
            cover = f"{found['cover'][0]:7.2f}{found['cover'][1]:6.2f}"
            print(f"{name:12}{kind:10}{own:10.4g}{columns}{bounded}{cover}", flush=True)
    print("geometric means over DEMs")
    for kind, by_peer in ratios.items():
        means = {peer: np.exp(np.mean(np.log(shares))) for peer, shares in by_peer.items()}
        columns = "".join(f"{means[peer]:11.3f}" for peer in PEERS)
        bounded = f"{means['bounded']:9.3f}" if "bounded" in means else ""
        print(f"{'all':12}{kind:10}{'':10}{columns}{bounded}")


if __name__ == "__main__":
    main()
