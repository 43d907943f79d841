"""One function over many tasks in spawned processes of one thread each, as they come in."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from ..errors import SuppleError
from ..threads import one_thread


def available() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def results(
    work: Callable[..., Any],
    tasks: Sequence[tuple[Any, ...]],
    jobs: int,
    start: Callable[[], None] | None = None,
) -> Iterator[Any]:
    """``work(*task)`` of every task, in the order in which they end.

    If the caller stops early, by an interrupt too, tasks that run are awaited and no more begin.

    Args:
        work: a function of a module.
        jobs: processes; each calls ``start`` first.

    Raises:
        SuppleError: a process was killed. And whatever ``work`` raises.
    """
    if not tasks:
        return
    context = get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(tasks)), context, start) as pool:
        try:
            with one_thread(), _deaf():  # each submit starts a process until there are enough
                futures = [pool.submit(work, *task) for task in tasks[:jobs]]
            futures += [pool.submit(work, *task) for task in tasks[jobs:]]
            for future in as_completed(futures):
                yield future.result()
        except BrokenProcessPool:
            raise SuppleError(
                "a worker process was ended from outside, for lack of memory perhaps; "
                "try fewer --jobs, and --resume where the study has it."
            ) from None
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes that start inside leave Ctrl-C to the one that started them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
