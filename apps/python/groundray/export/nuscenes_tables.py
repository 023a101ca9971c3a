"""Tables of nuScenes: rows with tokens, and the chains between them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from groundray.dataset import Dataset
from groundray.export.categories import Category
from groundray.export.json_tables import table_text
from groundray.export.sensor_path import Floats, quaternion_wxyz
from groundray.file_content import read_text

Row = dict[str, Any]

NAMES = (
    *("attribute", "calibrated_sensor", "category", "ego_pose", "instance", "log", "map"),
    *("sample", "sample_annotation", "sample_data", "scene", "sensor", "visibility"),
)
_ATTRIBUTES = {
    "vehicle.moving": "Vehicle that moves.",
    "vehicle.parked": "Vehicle that stands.",
    "pedestrian.moving": "Person that moves.",
    "pedestrian.standing": "Person that stands.",
}
_MOVING_M_S = 0.1
# Upper bounds of the visible shares of nuScenes' levels, whose tokens are 1 to 4.
_LEVELS = {"v0-40": 0.4, "v40-60": 0.6, "v60-80": 0.8, "v80-100": 1.0}


class Tables:
    """The rows of all tables. Tokens are hashes of dataset.yaml, the scene, and the row's key."""

    def __init__(self, dataset: Dataset, scene_name: str) -> None:
        record = read_text(dataset.folder / "dataset.yaml")
        self._seed = hashlib.sha256(f"{scene_name}\n{record}".encode()).hexdigest()
        self.rows: dict[str, list[Row]] = {name: [] for name in NAMES}

    def token(self, table: str, *key: object) -> str:
        """Returns the token of a row: 32 hexadecimal digits."""
        text = "\n".join([self._seed, table, *map(str, key)])
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def add(self, table: str, key: Sequence[object], row: Mapping[str, Any]) -> str:
        """Adds a row; returns its token."""
        token = self.token(table, *key)
        self.rows[table].append({"token": token, **row})
        return token

    def write(self, folder: Path) -> None:
        """Writes a file for each table."""
        for name, rows in self.rows.items():
            (folder / f"{name}.json").write_text(table_text(rows) + "\n", encoding="utf-8")


def chain(rows: Sequence[Row]) -> None:
    """Links rows, which are in order of time, by prev and next; the ends are empty."""
    tokens = [row["token"] for row in rows]
    for i, row in enumerate(rows):
        row["prev"] = tokens[i - 1] if i > 0 else ""
        row["next"] = tokens[i + 1] if i + 1 < len(rows) else ""


def place(X: Floats) -> Row:
    """Returns a pose as translation and rotation w, x, y, z."""
    return {"translation": X[:3, 3].tolist(), "rotation": list(quaternion_wxyz(X[:3, :3]))}


def microseconds(dataset: Dataset, time_ns: int) -> int:
    """Returns a time of nuScenes, with the origin of the dataset's clock."""
    return round((dataset.time_origin_ns + time_ns) / 1000)


def add_attributes(tables: Tables) -> None:
    """Adds all attributes and the levels of visibility."""
    for name, description in _ATTRIBUTES.items():
        tables.add("attribute", [name], {"name": name, "description": description})
    lower = 0.0
    for i, (level, upper) in enumerate(_LEVELS.items()):
        text = f"{lower:.0%} to {upper:.0%} of the object are visible"
        tables.rows["visibility"].append({"token": str(i + 1), "level": level, "description": text})
        lower = upper


def attributes_of(tables: Tables, category: Category, speed_m_s: float) -> list[str]:
    """Returns the tokens of the attributes of vehicles and pedestrians; none for others."""
    is_moving = speed_m_s > _MOVING_M_S
    if category.name.startswith("vehicle."):
        name = "vehicle.moving" if is_moving else "vehicle.parked"
    elif category.name.startswith("human.pedestrian."):
        name = "pedestrian.moving" if is_moving else "pedestrian.standing"
    else:
        return []
    return [tables.token("attribute", name)]


def visibility_of(visible_share: float | None) -> str:
    """Returns the token of a level; empty if the share is unknown."""
    if visible_share is None:
        return ""
    return str(1 + sum(visible_share > upper for upper in list(_LEVELS.values())[:-1]))


def add_log(tables: Tables, dataset: Dataset, scene_name: str, begin_us: int) -> str:
    """Adds the log, with its date in UTC, and an empty map; returns the log's token."""
    date = datetime(1970, 1, 1) + timedelta(microseconds=begin_us)
    log = {
        "logfile": scene_name,
        "vehicle": "groundray",
        "date_captured": date.strftime("%Y-%m-%d"),
        "location": dataset.crs or "groundray",
    }
    token = tables.add("log", [scene_name], log)
    name = f"maps/{tables.token('map')}.png"
    about = {"category": "semantic_prior", "log_tokens": [token], "filename": name}
    tables.add("map", [], about)
    return token
