"""A progress line on stderr for whatever takes longer than two seconds."""

from __future__ import annotations

import sys
import threading
import time
from typing import TextIO

from ._stop import go_on

PATIENCE = 2.0
"""Seconds of silence before the line appears."""
REPEAT = 10.0
"""Seconds after which the same stage is written again where lines cannot be overwritten."""


class Progress:
    """Call it with a stage, and with a fraction where one is known; it decides what is seen.

    On a terminal one line is overwritten and cleared at the end; elsewhere a line is written when
    the stage changes and every ten seconds. It ticks by itself while a stage says nothing.
    """

    def __init__(self, stream: TextIO | None = None, patience: float = PATIENCE) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._patience = patience
        self._stage = "working"
        self._fraction: float | None = None
        self._begin = time.monotonic()
        self._written: tuple[str, float] = ("", 0.0)
        self._over = threading.Event()
        self._clock = threading.Thread(target=self._tick, daemon=True)

    def __call__(self, stage: str, fraction: float | None = None) -> None:
        """`stage` begins, or goes on with `fraction` (0 to 1) of it done."""
        go_on()
        self._stage, self._fraction = stage, fraction

    def __enter__(self) -> Progress:
        self._clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._clock.join()
        if self._written[0] and self._stream.isatty():
            self._stream.write("\r\x1b[2K")
            self._stream.flush()

    def _tick(self) -> None:
        while not self._over.wait(min(0.25, self._patience)):
            elapsed = time.monotonic() - self._begin
            if elapsed >= self._patience:
                self._write(elapsed)

    def _write(self, elapsed: float) -> None:
        stage, last = self._written
        share = "" if self._fraction is None else f" {100 * self._fraction:.0f} %"
        line = f"{self._stage}{share} ({elapsed:.0f} s)"
        if self._stream.isatty():
            self._stream.write(f"\r\x1b[2K{line}")
        elif stage != self._stage or elapsed - last >= REPEAT:
            self._stream.write(line + "\n")
        else:
            return
        self._stream.flush()
        self._written = (self._stage, elapsed)
