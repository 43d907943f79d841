"""One use of a body at a time: its system in the runtime holds one set of values and one factor."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from .errors import InputError

Work = TypeVar("Work", bound=Callable[..., Any])


def alone(work: Work) -> Work:
    """A function of a body that raises InputError while the same body is at such work already.

    It does not wait: two threads that set parameters of one body would get each other's answers.
    """

    @functools.wraps(work)
    def guarded(body: Any, *args: Any, **options: Any) -> Any:
        if not body._busy.acquire(blocking=False):
            raise InputError(
                "the body is busy: it is being solved, in another thread or by the one that asks "
                "for progress; give each thread a body of its own, body.on(body.mesh)."
            )
        try:
            return work(body, *args, **options)
        finally:
            body._busy.release()

    return cast(Work, guarded)
