"""Scenes built in code."""

import datetime
import math
import numbers
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from groundray._core import Error, Mesh, Scene, Terrain, parse_scene


def scene(
    spec: str | Mapping[str, Any],
    *,
    folder: str | os.PathLike[str] = ".",
    terrain: Terrain | None = None,
    seed: int | None = None,
) -> Scene:
    """Builds a scene from the contents of a scene file (docs/reference/scene.md).

      spec     the text of a scene file, or the same as dicts and lists
      folder   base folder of the files that it names
      terrain  the ground, instead of the key `dem` of `terrain`
      seed     replaces the scene's own

    In dicts, `model` may be a Mesh in the frame O of the object, and `trajectory` an array, n x 8:
    t (s), x, y, z (m, in W) and the quaternion qx, qy, qz, qw of each pose, as in TUM files.

    Raises groundray.Error as load_scene does. Dicts are converted to YAML: lines and columns in
    messages refer to that text, and str(error) quotes the keys.
    """
    path = Path(folder) / "scene"
    if isinstance(spec, str):
        if terrain is not None:
            raise TypeError(
                "scene: with terrain=... spec must be a dict whose 'terrain' has no 'dem'"
            )
        return parse_scene(spec, path, seed)
    given = _Given()
    named = given.named(spec)
    if terrain is not None:
        ground = dict(named.get("terrain", {}))
        if "dem" in ground:
            raise ValueError("scene: give terrain=... or spec['terrain']['dem'], not both")
        named = {**named, "terrain": {"dem": "memory:terrain", **ground}}
    return parse_scene(to_yaml(named), path, seed, terrain, given.meshes, given.trajectories)


class _Given:
    """Objects of a scene that are in memory, by the names that stand for them in its text."""

    def __init__(self) -> None:
        self.meshes: dict[str, Mesh] = {}
        self.trajectories: dict[str, str] = {}

    def named(self, value: Any) -> Any:
        """Returns a part of a scene with names instead of meshes and arrays of poses."""
        if isinstance(value, Mesh):
            return self._name_of(value)
        if isinstance(value, Mapping):
            return {key: self._of_key(str(key), each) for key, each in value.items()}
        if isinstance(value, list | tuple) and any(isinstance(each, Mapping) for each in value):
            return [self.named(each) for each in value]
        return value

    def _of_key(self, key: str, value: Any) -> Any:
        if key != "trajectory" or isinstance(value, str | os.PathLike):
            return self.named(value)
        name = f"memory:trajectory {len(self.trajectories)}"
        self.trajectories[name] = _tum(value)
        return name

    def _name_of(self, mesh: Mesh) -> str:
        for name, other in self.meshes.items():
            if other is mesh:
                return name
        name = f"memory:mesh {len(self.meshes)}"
        self.meshes[name] = mesh
        return name


def _tum(poses: Any) -> str:
    rows = np.asarray(poses, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 8:
        raise TypeError(
            "scene: 'trajectory' must be a path or an array of shape (n, 8): t, x, y, z, qx, qy, "
            f"qz, qw; its shape is {rows.shape}"
        )
    if len(rows) == 0:
        raise ValueError("scene: 'trajectory' has no poses")
    if not np.isfinite(rows).all():
        raise ValueError("scene: 'trajectory' has numbers that are not finite")
    return "".join(
        f"{t:.9f} " + " ".join(repr(float(number)) for number in pose) + "\n" for t, *pose in rows
    )


class Plain(str):
    """A scalar of a scene file that was written without quotes."""


def edited_text(tree: dict[str, Any], seed: int, changes: Mapping[str, Any]) -> str:
    """Returns the text of a scene with the changes of Scene.edited.

    tree  the scene's file, as dicts and lists
    seed  the scene's seed, which may differ from its file's
    """
    for name in changes.keys() - _EDITS.keys():
        raise Error(
            f"edited: '{name}' cannot be changed in a scene that is built, but only "
            f"{', '.join(_EDITS)}: build another scene for it"
        )
    edited = {**tree, "seed": seed}
    for name, change in changes.items():
        if name != "seed" and not isinstance(change, Mapping):
            raise Error(f"edited: '{name}' must be a dict, but is a {type(change).__name__}")
        _EDITS[name](edited, change)
    return to_yaml(edited)


def _change_weather(scene: dict[str, Any], weather: Mapping[str, Any]) -> None:
    scene.pop("weather", None)
    if weather:
        scene["weather"] = dict(weather)


def _change_sun(scene: dict[str, Any], sun: Mapping[str, Any]) -> None:
    if not isinstance(scene.get("sky"), dict):
        raise Error("edited: 'sun' is that of the sky, but the scene has no 'sky'")
    scene["sky"] = {**scene["sky"], "sun": dict(sun)}


def _change_mounts(scene: dict[str, Any], mounts: Mapping[str, Mapping[str, Any]]) -> None:
    _change_entries(scene, ("lidars", "cameras"), "lidar or camera", "mount", mounts)


def _change_densities(scene: dict[str, Any], densities: Mapping[str, float]) -> None:
    _change_entries(scene, ("scatter",), "layer", "density_per_m2", densities)


def _change_entries(
    scene: dict[str, Any], lists: Sequence[str], kind: str, key: str, changes: Mapping[str, Any]
) -> None:
    names = [entry["name"] for part in lists for entry in scene.get(part, [])]
    for name in changes:
        if name not in names:
            raise Error(
                f"edited: the scene has no {kind} '{name}'; it has {', '.join(names) or 'none'}"
            )
    for part in lists:
        if part in scene:
            scene[part] = [
                {**entry, key: changes[entry["name"]]} if entry["name"] in changes else entry
                for entry in scene[part]
            ]


_EDITS: dict[str, Callable[[dict[str, Any], Any], None]] = {
    "seed": lambda scene, seed: scene.update(seed=seed),
    "weather": _change_weather,
    "sky": lambda scene, sky: scene.update(sky=dict(sky)),
    "sun": _change_sun,
    "mounts": _change_mounts,
    "density_per_m2": _change_densities,
}


def to_yaml(value: Any, indent: int = 0) -> str:
    """Returns dicts, lists, texts, numbers and paths as YAML."""
    if isinstance(value, Mapping) and value:
        return "".join(
            f"{' ' * indent}{_scalar(str(key))}:{_below(each, indent)}"
            for key, each in value.items()
        )
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple) and any(isinstance(each, Mapping) for each in value):
        return "".join(f"{' ' * indent}-\n{to_yaml(each, indent + 2)}" for each in value)
    return f"{' ' * indent}{_flow(value)}\n"


def _below(value: Any, indent: int) -> str:
    is_block = isinstance(value, Mapping) or (
        isinstance(value, list | tuple) and any(isinstance(each, Mapping) for each in value)
    )
    return "\n" + to_yaml(value, indent + 2) if is_block and value else f" {_flow(value)}\n"


def _flow(value: Any) -> str:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        items = (f"{_scalar(str(key))}: {_flow(each)}" for key, each in value.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _scalar(value)


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, Plain) and _NUMBER_OR_WORD.fullmatch(value):
        return str(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        number = float(value)
        if math.isfinite(number):
            text = repr(number)  # YAML 1.1 reads 1.0e-07 as a number, but not 1e-07
            return text if "." in text else text.replace("e", ".0e")
        return ".nan" if math.isnan(number) else (".inf" if number > 0 else "-.inf")
    if isinstance(value, str | os.PathLike):
        return _text(os.fspath(value))
    if isinstance(value, datetime.datetime):  # yaml.safe_load makes one of `sun.utc`
        utc = value.astimezone(datetime.UTC) if value.tzinfo else value
        return _text(utc.replace(tzinfo=None).isoformat() + "Z")
    raise TypeError(
        f"scene: {value!r} is a {type(value).__name__}; allowed are dicts, lists, texts, numbers, "
        "times, paths and arrays"
    )


def _text(text: str) -> str:
    is_plain = text.isascii() and text.replace("_", "").replace("-", "").isalnum()
    is_word = is_plain and text[0].isalpha() and text.lower() not in _WORDS
    if is_word:
        return text
    return '"' + "".join(_ESCAPES.get(each, each) for each in text) + '"'


_NUMBER_OR_WORD = re.compile(r"[-+.\w]+", re.ASCII)  # plain in any place, even in [ ] and { }
_WORDS = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
