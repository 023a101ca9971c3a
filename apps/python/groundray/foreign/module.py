"""Frame of the modules that groundray's programs run: exit codes, and errors of one line."""

from __future__ import annotations

import importlib.util
import math
import resource
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from groundray.dataset import Error
from groundray.file_content import available_bytes, open_regular

DONE, FAILED, LACKING = 0, 3, 4
"""Exit codes, which apps/scan/python_module.cpp knows; Python itself exits with 1 and 2."""


class LackingError(Exception):
    """A package is not installed."""


def need(packages: Mapping[str, str], what: str) -> None:
    """Raises LackingError unless all modules can be imported.

    packages: their names in pip by module. what: what needs them, for the message.
    """
    missing = [name for module, name in packages.items() if not importlib.util.find_spec(module)]
    if missing:
        names = ", ".join(missing)
        install = " ".join(missing)
        raise LackingError(f"{what} needs {names}, which this Python lacks: pip install {install}")


def _limit_memory() -> None:
    """Lets allocations fail that exceed the available memory, as damaged files may ask for."""
    free = available_bytes()
    if math.isfinite(free):
        with open_regular(Path("/proc/self/statm")) as sizes:
            used = int(sizes.read().split()[0]) * resource.getpagesize()
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = used + int(free)
        if hard == resource.RLIM_INFINITY or limit < hard:
            resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def run(work: Callable[[list[str]], str]) -> int:
    """Prints what `work` returns for the command's arguments; returns the exit code."""
    sys.stdout.reconfigure(encoding="utf-8", errors="backslashreplace")  # type: ignore[union-attr]
    sys.stderr.reconfigure(encoding="utf-8", errors="backslashreplace")  # type: ignore[union-attr]
    try:
        _limit_memory()
        sys.stdout.write(work(sys.argv[1:]))
        sys.stdout.flush()
    except LackingError as lack:
        print(lack, file=sys.stderr)
        return LACKING
    except KeyboardInterrupt:
        return FAILED
    except MemoryError:
        print("it needs more memory than is available: is it damaged?", file=sys.stderr)
        return FAILED
    except OSError as fault:
        print(fault.strerror or fault, file=sys.stderr)
        return FAILED
    except SystemExit:
        raise
    except (
        BaseException
    ) as fault:  # whatever a library raises for a damaged file, Rust's panics too
        text = " ".join(str(fault).split())[:500] or type(fault).__name__
        if not isinstance(fault, Error):
            text = f"it cannot be read: {text}: is it damaged, or cut short?"
        print(text, file=sys.stderr)
        return FAILED
    return DONE
