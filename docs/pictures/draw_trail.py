"""Draws docs/pictures/offroad_trail.png: a camera and a lidar in data/scenes/offroad_trail.yaml.

    pip install numpy opencv-python-headless openexr pillow plyfile pyyaml
    python3 docs/pictures/draw_trail.py build/release/bin out/trail_picture

The world and the drive are those of the scene; the light is that of the afternoon, the camera looks
past the vehicle's right side, and the lidar has 128 beams. Rendering takes five minutes of two
cores; a finished dataset in the folder is used again.
"""

import pathlib
import subprocess
import sys

import cv2
import numpy as np
import OpenEXR
import plyfile
import yaml
from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "data/scenes/offroad_trail.yaml"
CAMERA_PX, SIDE_PX, GAP_PX = (1064, 598), (532, 297), 4
CLOUD_PX = (CAMERA_PX[0] + GAP_PX + SIDE_PX[0], 298)
SUPER = 2  # the cloud is drawn larger and reduced
NIGHT = np.array([20, 15, 13.0])  # blue, green, red, as all colours here
# By label: name and colour.
KINDS = {
    1: ("ground", (96, 132, 160)),
    2: ("grass", (72, 214, 214)),
    3: ("shrubs", (150, 200, 60)),
    4: ("rocks", (225, 220, 220)),
    5: ("trees", (84, 170, 70)),
    10: ("vehicle", (66, 122, 255)),
    11: ("person", (214, 96, 255)),
    12: ("fence posts", (255, 176, 90)),
}
SKY = (196, 164, 128)
SUN = np.array([-0.79, -0.09, 0.6])  # towards it, in D
FONT = ImageFont.load_default(22)
EYE_M, TARGET_M = np.array([-59.0, -47, 390]), np.array([-38, -25.5, 388.2])  # in D
FOCAL, NEAR_M, POINT = 0.72, 2, 42  # focal length per width; radius of points at 1 m, px


def write_scene(folder: pathlib.Path) -> pathlib.Path:
    scene = yaml.safe_load(SCENE.read_text())
    terrain = scene["terrain"]
    terrain["dem"] = str((SCENE.parent / terrain["dem"]).resolve())
    albedo = SCENE.parent / terrain["texture"]["albedo"]
    terrain["texture"]["albedo"] = str(albedo.resolve())
    scene["sky"]["sun"]["utc"] = "2026-06-21T22:30:00Z"
    width, height = CAMERA_PX
    camera = {
        "groundray_camera": 1,
        "model": "A camera without distortion",
        "size_px": [width, height],
        "lens": {
            "pinhole": {
                "focal_px": [0.85 * width, 0.85 * width],
                "centre_px": [(width - 1) / 2, (height - 1) / 2],
            }
        },
        "rate_hz": 1,
        "first_ms": 500,
        "shutter": {"exposure_ms": 0.5},
        "sampling": {"samples": 32, "depth": 4},
        "products": ["radiance", "truth"],
    }
    (folder / "camera.yaml").write_text(yaml.safe_dump(camera))
    mount = {"translation_m": [4, -3.5, 2.4], "yaw_deg": 12, "pitch_deg": 3}
    scene["cameras"] = [{"name": "view", "file": "camera.yaml", "mount": mount}]
    top = {"name": "top", "preset": "ouster_os1_128", "mount": {"translation_m": [0, 0, 1.8]}}
    scene["lidars"] = [top]
    del scene["stereo"]
    file = folder / "scene.yaml"
    file.write_text(yaml.safe_dump(scene, sort_keys=False))
    return file


def encode(light: np.ndarray) -> np.ndarray:
    """Returns sRGB bytes of linear light, of which 1 is white."""
    light = np.clip(light, 0, 1)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return 255 * encoded


def develop(channels: dict[str, np.ndarray]) -> np.ndarray:
    """Exposes as a camera does: 99 % of the pixels' brightest channels are below 0.9 of white."""
    light = channels["RGB"]
    return encode(light[..., ::-1] * 0.9 / np.percentile(light.max(axis=-1), 99))


def shade(normals: np.ndarray) -> np.ndarray:
    return (0.62 + 0.38 * np.clip(normals @ SUN, -0.3, 1))[..., None]


def draw_depth(channels: dict[str, np.ndarray]) -> np.ndarray:
    depth_m = channels["Z"]
    seen = np.isfinite(depth_m)
    near, far = np.log(np.percentile(depth_m[seen], [0.5, 99.5]))
    share = (np.log(np.where(seen, depth_m, 1)) - near) / (far - near)
    bytes_ = np.clip(255 * (1 - share), 0, 255).astype(np.uint8)
    return np.where(seen[..., None], cv2.applyColorMap(bytes_, cv2.COLORMAP_VIRIDIS), NIGHT)


def draw_labels(channels: dict[str, np.ndarray]) -> np.ndarray:
    label = channels["Label"]
    picture = np.ones((*label.shape, 3)) * SKY
    light = shade(np.stack([channels[f"N.{axis}"] for axis in "XYZ"], axis=-1))
    for number, (_, colour) in KINDS.items():
        picture = np.where((label == number)[..., None], light * colour, picture)
    return picture


def project(points_m: np.ndarray) -> np.ndarray:
    """Returns the pixels of the large picture of the cloud, and the depths."""
    ahead = (TARGET_M - EYE_M) / np.linalg.norm(TARGET_M - EYE_M)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    seen = (points_m - EYE_M) @ np.stack([right, np.cross(ahead, right), ahead]).T
    centre = SUPER * np.array(CLOUD_PX) / 2
    depth_m = np.maximum(seen[:, 2:], 0.1)
    return np.hstack([centre + FOCAL * SUPER * CLOUD_PX[0] * seen[:, :2] / depth_m, seen[:, 2:]])


def draw_cloud(scan: np.ndarray) -> np.ndarray:
    def columns(*names: str) -> np.ndarray:
        return np.column_stack([scan[name] for name in names]).astype(float)

    seen = project(columns("world_x", "world_y", "world_z"))
    colours = np.array([KINDS[label][1] for label in scan["label"]], float)
    colours *= shade(columns("nx", "ny", "nz"))
    width, height = (SUPER * side for side in CLOUD_PX)
    picture = np.ones((height, width, 3)) * NIGHT
    inside = (seen[:, 2] > NEAR_M) & (np.abs(seen[:, 0] - width / 2) < width)
    for i in np.flatnonzero(inside)[np.argsort(-seen[inside, 2])]:
        radius_px = max(1.9, POINT * SUPER / seen[i, 2])
        centre = tuple(round(float(16 * value)) for value in seen[i, :2])
        cv2.circle(picture, centre, int(16 * radius_px), colours[i], -1, cv2.LINE_AA, 4)
    return cv2.resize(picture, CLOUD_PX, interpolation=cv2.INTER_AREA)


def caption(picture: np.ndarray, text: str) -> np.ndarray:
    image = Image.fromarray(np.clip(np.round(picture), 0, 255).astype(np.uint8)[..., ::-1])
    draw = ImageDraw.Draw(image, "RGBA")
    box = draw.textbbox((16, 10), text, font=FONT)
    draw.rounded_rectangle((box[0] - 8, box[1] - 6, box[2] + 8, box[3] + 6), 6, (13, 15, 20, 170))
    draw.text((16, 10), text, font=FONT, fill="white")
    return np.asarray(image)[..., ::-1].astype(float)


def add_legend(picture: np.ndarray, labels: np.ndarray) -> np.ndarray:
    image = Image.fromarray(picture.astype(np.uint8)[..., ::-1])
    draw = ImageDraw.Draw(image, "RGBA")
    kinds = [kind for number, kind in KINDS.items() if (labels == number).any()]
    widths = [draw.textlength(name, font=FONT) + 56 for name, _ in kinds]
    x, y = image.width - sum(widths), image.height - 22
    draw.rounded_rectangle((x - 14, y - 16, image.width - 8, y + 16), 6, (13, 15, 20, 200))
    for (name, colour), width in zip(kinds, widths, strict=True):
        draw.ellipse((x, y - 7, x + 14, y + 7), fill=colour[::-1])
        draw.text((x + 22, y), name, font=FONT, fill="white", anchor="lm")
        x += width
    return np.asarray(image)[..., ::-1].astype(float)


def compose(run: pathlib.Path) -> Image.Image:
    with OpenEXR.File(str(run / "camera/view/000000.exr")) as file:
        channels = {name: each.pixels for name, each in file.channels().items()}
    if "RGB" not in channels:
        channels["RGB"] = np.stack([channels[each] for each in "RGB"], axis=-1)
    scan = plyfile.PlyData.read(run / "lidar/top/000005.ply")["vertex"].data
    whole = np.ones((CAMERA_PX[1] + GAP_PX + CLOUD_PX[1], CLOUD_PX[0], 3)) * 255
    width, height = CAMERA_PX
    whole[:height, :width] = caption(develop(channels), "camera, path-traced")
    for top, picture, text in (
        (0, draw_depth(channels), "depth"),
        (height - SIDE_PX[1], draw_labels(channels), "labels"),
    ):
        small = cv2.resize(picture, SIDE_PX, interpolation=cv2.INTER_AREA)
        whole[top : top + SIDE_PX[1], width + GAP_PX :] = caption(small, text)
    cloud = caption(draw_cloud(scan), "lidar: the sweep at that time, by label")
    whole[height + GAP_PX :] = add_legend(cloud, scan["label"])
    return Image.fromarray(np.clip(np.round(whole), 0, 255).astype(np.uint8)[..., ::-1])


def main() -> None:
    programs, folder = map(pathlib.Path, sys.argv[1:])
    folder.mkdir(parents=True, exist_ok=True)
    run = folder / "run"
    if not (run / "dataset.yaml").exists():
        command = [programs / "groundray", "generate", write_scene(folder), "-o", run]
        subprocess.run(command, check=True)
    # Fewer levels compress better than all of them, and 256 colours would show as bands.
    levels = np.asarray(compose(run)).astype(int)
    picture = Image.fromarray(((levels + 1) // 3 * 3).astype(np.uint8))
    picture.save(ROOT / "docs/pictures/offroad_trail.png", optimize=True)


if __name__ == "__main__":
    main()
