"""Where the seconds of a run go, phase by phase; costs nothing unless somebody collects them.

with collect() as profile:  # `supple solve --profile`
    ...                     # phases inside of phases count once, as the inner one
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

#: Phases that the runtime times itself.
NATIVE = ("analysis", "assembly", "residual", "factor", "solve")


@dataclass
class Phase:
    """How often a phase was gone through, and for how long."""

    seconds: float = 0.0
    calls: int = 0


@dataclass
class Profile:
    """The phases of one run by name, in the order of their first end."""

    phases: dict[str, Phase] = field(default_factory=dict)
    begin: float = field(default_factory=time.perf_counter)
    seconds: float = 0.0  # of the whole, once it is over
    _inner: list[float] = field(default_factory=list)  # seconds of phases inside, by depth

    def add(self, name: str, seconds: float, calls: int = 1) -> None:
        """More of a phase."""
        phase = self.phases.setdefault(name, Phase())
        phase.seconds += seconds
        phase.calls += calls

    @contextmanager
    def timed(self, part: Part) -> Iterator[None]:
        """Count what runs inside as ``part``, but for the phases in it."""
        begin = time.perf_counter()
        self._inner.append(0.0)
        try:
            yield
        finally:
            spent = time.perf_counter() - begin
            self.add(part.name, spent - self._inner.pop())
            self._count_inside(spent)

    def native(self, timings: Any, iterations: int) -> None:
        """What the runtime counted in one solve."""
        calls = {"assembly": iterations, "factor": timings.factorisations,
                 "solve": timings.krylov_iterations or iterations}  # fmt: skip
        for name in NATIVE:
            seconds = getattr(timings, name)
            self.add(name, seconds, calls.get(name, 1))
            self._count_inside(seconds)

    def _count_inside(self, seconds: float) -> None:
        if self._inner:
            self._inner[-1] += seconds


@dataclass
class Part:
    """A phase while it runs; its name may be given at its end."""

    name: str


_current: ContextVar[Profile | None] = ContextVar("profile", default=None)


@contextmanager
def collect() -> Iterator[Profile]:
    """A profile of all that runs inside."""
    profile = Profile()
    token = _current.set(profile)
    try:
        yield profile
    finally:
        profile.seconds = time.perf_counter() - profile.begin
        _current.reset(token)


@contextmanager
def phase(name: str) -> Iterator[Part]:
    """What runs inside is of this phase, where somebody collects; a decorator too."""
    part, profile = Part(name), _current.get()
    if profile is None:
        yield part
        return
    with profile.timed(part):
        yield part


def native(timings: Any, iterations: int) -> None:
    """What the runtime counted in one solve, where somebody collects."""
    profile = _current.get()
    if profile is not None:
        profile.native(timings, iterations)
