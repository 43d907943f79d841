"""Tasks in spawned processes of one thread each, which prepare once and answer again and again.

    prepare(*parts) → work, in each process;   work(task) → its answer, one task at a time each

A process that ends from outside takes its task with it and no other. None outlives the process
that started it, however that ends.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import Any

from .errors import InputError, SuppleError
from .threads import one_thread

Prepare = Callable[..., Callable[[Any], Any]]
#: What a process says before its first answer.
_READY = "ready"
#: Seconds in which processes without a task left have to end.
_PATIENCE = 5.0


class Lost(SuppleError):
    """The process at work on a task was ended from outside."""


def inside() -> bool:
    """Whether this process is one that another started to share its work."""
    return parent_process() is not None


class Workers:
    """Processes that are asked again and again; used as a context, at whose end they end.

    Args:
        count: processes; with 1, and inside of a process that works for another, all is done here.
        prepare: a function of a module, called with ``parts`` once in each process.
        *parts: what it needs; every process gets a copy once.

    Raises:
        InputError: ``prepare`` or ``parts`` cannot be sent to another process.
    """

    def __init__(self, count: int, prepare: Prepare, *parts: Any) -> None:
        self.count = 1 if inside() else count
        self._pipes: dict[Connection, Any] = {}  # of processes that wait or work → process
        self._here = prepare(*parts) if self.count < 2 else None
        self._message = b"" if self._here else _sent((prepare, parts))

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._end(patience=_PATIENCE if kind is None else 0.0)

    def answers(self, tasks: Sequence[Any], lose: bool = False) -> Iterator[tuple[int, Any]]:
        """(number of the task, its answer) of every task, in the order in which they come in.

        If the caller stops early, by an interrupt too, the processes are ended.

        Args:
            lose: the answer of a task whose process died is the `Lost`, and the others go on.

        Raises:
            Lost: a process died. And whatever ``prepare`` or the work raises.
        """
        if self._here:
            yield from enumerate(map(self._here, tasks))
            return
        try:
            for number, answer in self._collected(tasks):
                if isinstance(answer, Lost) and not lose:
                    raise answer
                yield number, answer
        except BaseException:
            self._end(patience=0.0)
            raise

    def _collected(self, tasks: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        todo, busy = deque(enumerate(tasks)), dict[Connection, int]()
        while todo or busy:
            self._start(min(self.count, len(busy) + len(todo)))
            for pipe in [p for p in self._pipes if p not in busy][: len(todo)]:
                busy[pipe] = self._give(pipe, todo.popleft())
            for pipe in [p for p in wait(list(busy)) if isinstance(p, Connection)]:
                number = busy.pop(pipe)
                try:
                    message = pipe.recv_bytes()
                except (EOFError, OSError):
                    yield number, self._lost(pipe, number)
                else:
                    yield number, _opened(message)

    def _give(self, pipe: Connection, task: tuple[int, Any]) -> int:
        with contextlib.suppress(BrokenPipeError):  # it died: its end of file says so
            pipe.send_bytes(_sent(task[1]))
        return task[0]

    def _start(self, count: int) -> None:
        """Start processes until there are ``count``; each has said that it is ready."""
        new = []
        while len(self._pipes) < count:
            with one_thread(), _deaf():
                ours, theirs = get_context("spawn").Pipe()
                process = get_context("spawn").Process(
                    target=_serve, args=(theirs, self._message), daemon=True
                )
                self._pipes[ours] = process
                process.start()
                theirs.close()
            new.append(ours)
        for pipe in new:
            try:
                message = pipe.recv_bytes()
            except (EOFError, OSError):
                raise SuppleError(
                    "a worker process ended before its first task; in a script, call this under "
                    'if __name__ == "__main__":, and with fewer processes if memory is short.'
                ) from None
            _opened(message)

    def _lost(self, pipe: Connection, number: int) -> Lost:
        process = self._pipes.pop(pipe)
        process.join(_PATIENCE)
        pipe.close()
        return Lost(
            f"task {number} is lost: its worker process was ended from outside (exit code "
            f"{process.exitcode}), for lack of memory perhaps; try fewer processes."
        )

    def _end(self, patience: float) -> None:
        """They end at the end of their pipe; what is at work still is killed."""
        with _deaf():
            for pipe in self._pipes:
                pipe.close()
            for process in self._pipes.values():
                if process.pid is None:
                    continue
                process.join(patience)
                process.kill()
                process.join()
            self._pipes.clear()


def _serve(pipe: Connection, message: bytes) -> None:
    """The life of a process."""
    threading.Thread(target=_follow_parent, daemon=True).start()
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        try:
            prepare, parts = pickle.loads(message)
            work = prepare(*parts)
        except Exception as error:
            pipe.send_bytes(_raised(error))
            return
        pipe.send_bytes(_sent((True, _READY)))
        while True:
            task = pickle.loads(pipe.recv_bytes())
            try:
                answer = _sent((True, work(task)))
            except Exception as error:
                answer = _raised(error)
            pipe.send_bytes(answer)


def _follow_parent() -> None:
    """Ends this process with the one that started it, in the middle of a task too."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _opened(message: bytes) -> Any:
    good, answer = pickle.loads(message)
    if not good:
        raise answer
    return answer


def _raised(error: Exception) -> bytes:
    """The exception as a message; in words where it cannot be sent as it is."""
    try:
        message = _sent((False, error))
        pickle.loads(message)
    except Exception:
        message = _sent((False, SuppleError(f"{type(error).__name__} in a worker: {error}")))
    return message


def _sent(thing: Any) -> bytes:
    try:
        return bytes(ForkingPickler.dumps(thing))
    except (pickle.PicklingError, AttributeError, TypeError) as problem:
        raise InputError(
            f"what goes to or comes from another process must be data, and functions those of a "
            f"module: {problem}; define the function at the top of a file, or ask for one process."
        ) from None


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Ctrl-C waits until the end; processes that start inside never hear it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
