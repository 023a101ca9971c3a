"""Tables as JSON text, one row a line."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any


def table_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Returns a list of rows."""
    return "[" + ",".join(f"\n{_text(row)}" for row in rows) + "\n]"


def record_text(record: Mapping[str, Any]) -> str:
    """Returns a record whose lists are tables."""
    lines = (
        f"\n{json.dumps(key)}: {table_text(value) if isinstance(value, list) else _text(value)}"
        for key, value in record.items()
    )
    return "{" + ",".join(lines) + "\n}\n"


def _text(value: Any) -> str:
    return json.dumps(value, allow_nan=False, separators=(",", ":"))
