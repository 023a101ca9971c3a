#!/usr/bin/env python3
"""Runs groundray's program of this script's name, which is in the installed Python package."""

import importlib.util
import os
import sys
from pathlib import Path

name = Path(sys.argv[0]).name
package = importlib.util.find_spec("groundray")  # without importing it, which takes longer
if package is None or package.origin is None:
    sys.exit(f"{name}: {sys.executable} has no package groundray: pip install groundray")
os.environ.setdefault("GROUNDRAY_PYTHON", sys.executable)  # for formats that Python reads
program = Path(package.origin).parent / "bin" / name
os.execv(program, [name, *sys.argv[1:]])
