"""Many solves of one body: what each changes, where it starts, and in which process it runs.

entries ─► checked ─► the first here ─► the others here or in workers.py ─► states in order

Each starts from what its process has solved nearby (nearby.py).
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from . import assembly, terms
from .alone import alone
from .errors import ConvergenceError, InputError, SuppleError
from .nearby import Nearby, numbers
from .state import State
from .threads import available

if TYPE_CHECKING:
    from .body import Body

#: Seconds of work that are left below which to start processes would not pay.
WORTHWHILE = 5.0


@dataclass(frozen=True)
class Request:
    """What was asked for; `Body.solve_many` says what the names mean."""

    parameters: Sequence[Any]
    processes: int | None
    warm: bool
    reduce: Callable[[State], Any] | None
    change: Callable[[Body, Any], object]
    progress: Callable[[int, int], None] | None
    settings: dict[str, Any]

    def __post_init__(self) -> None:
        whole = isinstance(self.processes, int) and not isinstance(self.processes, bool)
        if self.processes is not None and not (whole and self.processes >= 1):
            raise InputError(
                f"processes must be at least 1, a whole number, or None, got {self.processes!r}."
            )
        from .body import Body

        known = set(inspect.signature(Body.solve).parameters) - {"self", "start", "progress"}
        for name in self.settings:
            if name not in known:
                raise InputError(f"{name} is no setting of a solve; known are {sorted(known)}.")


def change(body: Body, entry: Mapping[str, Any]) -> None:
    """Give the body the parameters of an entry, by the names that `Body.solve_many` lists."""
    if not isinstance(entry, Mapping):
        raise InputError(
            f"parameters must be mappings from names to values, got {type(entry).__name__}; give "
            "change=, a function that says what it means."
        )
    owners: dict[str, dict[str, Any]] = {}
    for name, value in entry.items():
        owner, _, parameter = name.rpartition(".")
        owners.setdefault(owner, {})[parameter] = value
    gravity = owners.get("", {}).pop("gravity", None)
    if gravity is not None:
        body.gravity(gravity)
    for owner, values in owners.items():
        if owner == "skin":
            body.set_skin(**values)
        elif values:
            body.set(owner or None, **values)


def solve(body: Body, asked: Request) -> list[Any]:
    """What `Body.solve_many` returns."""
    for number, entry in enumerate(asked.parameters):
        _changed(body, entry, number, asked)
    if not asked.parameters:
        return []
    alone(assembly.system)(body)  # compiles what is not compiled yet, once
    from .workers import Lost  # and multiprocessing: one who solves once does without

    found: list[Any] = [None] * len(asked.parameters)
    for done, (number, answer) in enumerate(_answers(body, asked), 1):
        if isinstance(answer, Lost):
            answer = SuppleError(f"parameters[{number}]: {answer}")
        found[number] = _with_body(answer, body, asked, number)
        if asked.progress:
            asked.progress(done, len(found))
    return found


def _answers(body: Body, asked: Request) -> Iterator[tuple[int, Any]]:
    """(number, answer) of every entry, as they come in."""
    from .workers import Workers

    entries, done = list(asked.parameters), 0
    count = min(asked.processes or available(), len(entries))
    parts = (body, replace(asked, parameters=(), progress=None))
    if asked.processes is None and count > 1:
        here, begin = Solver(*parts), time.monotonic()
        while done < len(entries):
            yield done, here(entries[done])
            done += 1
            if (time.monotonic() - begin) / done * (len(entries) - done) > WORTHWHILE:
                break
    if done < len(entries):
        with Workers(min(count, len(entries) - done), Solver, *parts) as pool:
            for number, answer in pool.answers(entries[done:], lose=True):
                yield done + number, answer


class Solver:
    """One process's: solves the body with one entry after the other."""

    def __init__(self, body: Body, asked: Request) -> None:
        self._body, self._asked, self._solved = body, asked, Nearby()

    def __call__(self, entry: Any) -> Any:
        """What `reduce` makes of the state, the state without its body, or the error."""
        asked = self._asked
        body = _changed(self._body, entry, None, asked)
        try:
            state = self._state(body, numbers(entry))
        except ConvergenceError as error:
            return error
        return asked.reduce(state) if asked.reduce else _bare(state)

    def _state(self, body: Body, x: Any) -> State:
        settings = self._asked.settings
        if not self._asked.warm:  # with no factor that another entry has left
            return body.solve(**({"solver": "direct"} | settings))
        state, start = None, self._solved.start(x)
        if start is not None:
            try:
                state = body.solve(start, **settings)
            except SuppleError:  # too far away: from zero it has its own way
                state = None
        if state is None:
            state = body.solve(**settings)
        self._solved.keep(x, state)
        return state


def _changed(body: Body, entry: Any, number: int | None, asked: Request) -> Body:
    """The body with one entry's changes.

    Raises:
        InputError: the entry does not fit; named by its ``number``.
    """
    changed = body.on(body.mesh)
    changed._built, changed._busy = body._built, body._busy  # other values in the same system
    try:
        asked.change(changed, entry)
    except InputError as error:
        if number is None:
            raise
        raise type(error)(f"parameters[{number}]: {error}") from error
    return changed


def _bare(state: State) -> State:
    """Without the mesh and laws, which the one who asked has."""
    nothing: Any = None
    return replace(state, _solved=nothing)


def _with_body(answer: Any, body: Body, asked: Request, number: int) -> Any:
    """The answer; a state of another process with this one's mesh and laws, which stayed here."""
    if asked.reduce or not isinstance(answer, State):
        return answer
    changed = _changed(body, asked.parameters[number], number, asked)
    return replace(answer, _solved=terms.snapshot(changed._description))
