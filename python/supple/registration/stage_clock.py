"""How long each stage of a registration takes."""

from __future__ import annotations

import time
from collections.abc import Callable


class StageClock:
    """Seconds of each stage."""

    def __init__(self, progress: Callable[[str], None] | None) -> None:
        self.progress, self.name = progress, ""
        self.begun = self.since = time.perf_counter()
        self.seconds: dict[str, float] = {}

    def stage(self, name: str) -> None:
        now = time.perf_counter()
        if self.name:
            self.seconds[self.name] = now - self.since
        self.name, self.since = name, now
        if self.progress is not None and name:
            self.progress(name)

    def stop(self) -> dict[str, float]:
        self.stage("")
        return self.seconds | {"total": time.perf_counter() - self.begun}
