"""Work of a command: interrupts and errors become exit codes with one message."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from groundray.dataset import Error

DONE, FAILED, INTERRUPTED = 0, 1, 130  # argparse exits with 2 on wrong usage


class _Interrupts:
    """Raises KeyboardInterrupt on SIGINT and SIGTERM, and notes that one came.

    The note matters because compiled libraries (lazrs, for one) turn the exceptions of the Python
    code that they call into exceptions of their own.
    """

    def __init__(self) -> None:
        self.came = False

    def _interrupt(self, _signal: int, _frame: FrameType | None) -> None:
        self.came = True
        raise KeyboardInterrupt

    @contextmanager
    def raised(self) -> Iterator[None]:
        """Handles both signals within, if in the main thread; restores the handlers at the end."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        numbers = (signal.SIGINT, signal.SIGTERM)
        before = [signal.signal(number, self._interrupt) for number in numbers]
        try:
            yield
        finally:
            for number, handler in zip(numbers, before, strict=True):
                signal.signal(number, handler)


def run_guarded(work: Callable[[], str]) -> tuple[int, str]:
    """Runs work, which writes all or nothing; returns the exit code and a message."""
    interrupts = _Interrupts()
    interrupted = INTERRUPTED, "interrupted; nothing was written"
    try:
        with interrupts.raised():
            return DONE, work()
    except KeyboardInterrupt:
        return interrupted
    except Exception as fault:
        if interrupts.came:
            return interrupted
        if isinstance(fault, Error):
            return FAILED, str(fault)
        if isinstance(fault, OSError):
            place = f"{fault.filename}: " if fault.filename else ""
            return FAILED, f"{place}{fault.strerror or fault}; nothing was written"
        raise
