"""Scenes built in code."""

import math
import numbers
import os
import tempfile
import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from groundray._core import Scene, Terrain, parse_scene


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

    Raises groundray.Error as load_scene does. Dicts are converted to YAML: lines and columns in
    messages refer to that text, and str(error) quotes the keys.
    """
    path = Path(folder) / "scene"
    if terrain is None:
        return parse_scene(spec if isinstance(spec, str) else to_yaml(spec), path, seed)
    if isinstance(spec, str):
        raise TypeError("scene: with terrain=... spec must be a dict whose 'terrain' has no 'dem'")
    ground = dict(spec.get("terrain", {}))
    if "dem" in ground:
        raise ValueError("scene: give terrain=... or spec['terrain']['dem'], not both")
    # Large terrain is read from its file on demand, so the file is kept as long as the scene.
    kept = tempfile.TemporaryDirectory(prefix="groundray-")
    try:
        file = Path(kept.name) / "terrain.tif"
        terrain.save(file)
        text = to_yaml({**spec, "terrain": {"dem": file, **ground}})
        made = parse_scene(text, path, seed)
    except BaseException:
        kept.cleanup()
        raise
    weakref.finalize(made, kept.cleanup)
    return made


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
    raise TypeError(
        f"scene: {value!r} is a {type(value).__name__}; allowed are dicts, lists, texts, numbers, "
        "paths and arrays"
    )


def _text(text: str) -> str:
    is_plain = text.isascii() and text.replace("_", "").replace("-", "").isalnum()
    is_word = is_plain and text[0].isalpha() and text.lower() not in _WORDS
    if is_word:
        return text
    return '"' + "".join(_ESCAPES.get(each, each) for each in text) + '"'


_WORDS = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
