"""Packages that only some commands need."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping

from groundray.dataset import Error


def check_packages(packages: Mapping[str, str], what: str) -> None:
    """Raises Error unless all modules can be imported.

    packages: their names in pip by module. what: what needs them, for the message.
    """
    missing = [name for module, name in packages.items() if not importlib.util.find_spec(module)]
    if missing:
        rule = f"{what} needs {', '.join(missing)}, which is not installed"
        raise Error(f"{rule}: pip install {' '.join(missing)}")
