"""Ctrl-C and SIGTERM unwind like an exception, so that unfinished output is removed.

A library that catches everything while it is imported swallows that exception: what stopped the
run is kept, and raised again at the next stage.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

TERMINATED = 143

_came: list[BaseException] = []


@contextmanager
def cleanly_stopped() -> Iterator[None]:
    """Of both signals; of Ctrl-C only where Python's own answer to it stands."""

    def leave(number: int, _frame: FrameType | None) -> None:
        _came.append(KeyboardInterrupt() if number == signal.SIGINT else SystemExit(TERMINATED))
        raise _came[-1]

    _came.clear()
    before = {signal.SIGTERM: signal.getsignal(signal.SIGTERM)}
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.default_int_handler
    try:
        for number in before:
            signal.signal(number, leave)
    except ValueError:  # not the main thread: signals are the host program's business
        yield
        return
    try:
        yield
    finally:
        _came.clear()
        for number, handler in before.items():
            signal.signal(number, handler)


def go_on() -> None:
    """Raises what stopped the run, if something did and was swallowed."""
    if _came:
        raise _came[-1]
