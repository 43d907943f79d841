"""Worker processes: each task answered once, deaths named, nothing left behind."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import supple
from supple.workers import Lost, Workers

#: Asks two workers for a nap; says their process ids first.
NAPS = """
import functools, signal
from supple.workers import Workers

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell's "&" turns off
    with Workers(2, functools.partial, eval) as pool:
        for _, pid in pool.answers(["__import__('os').getpid()"] * 2):
            print(pid, flush=True)
        list(pool.answers(["__import__('time').sleep(100)"] * 2))
"""
UNGUARDED = """
import functools
from supple.workers import Workers
with Workers(2, functools.partial, eval) as pool:
    print(list(pool.answers(["1", "2"])))
"""


def test_workers_have_one_thread_and_the_caller_keeps_its_own() -> None:
    before = dict(os.environ), signal.getsignal(signal.SIGINT)
    with Workers(2, functools.partial, os.getenv) as pool:
        assert dict(pool.answers(["OMP_NUM_THREADS"] * 2)) == {0: "1", 1: "1"}
    assert (dict(os.environ), signal.getsignal(signal.SIGINT)) == before


@pytest.mark.parametrize("count", [1, 2])
def test_answers_come_once_each_whoever_ends_first(count: int) -> None:
    with Workers(count, functools.partial, pow, 2) as pool:
        for _ in range(2):  # the same processes again
            assert dict(pool.answers(range(7))) == {n: 2**n for n in range(7)}
        assert list(pool.answers([])) == []


@pytest.mark.parametrize("count", [1, 2])
def test_what_a_worker_raises_reaches_the_caller(count: int) -> None:
    with Workers(count, functools.partial, divmod, 1) as pool, pytest.raises(ZeroDivisionError):
        list(pool.answers([1, 0]))
    with Workers(count, functools.partial, open) as pool, pytest.raises(FileNotFoundError):
        list(pool.answers(["/no/such/file"]))


def test_a_worker_that_dies_takes_one_task_with_it() -> None:
    """Killed in the middle of task 1; the other tasks are answered, by new workers too."""
    tasks = [f"{n} if {n} != 1 else __import__('os').kill(__import__('os').getpid(), 9)"
             for n in range(5)]  # fmt: skip
    with Workers(2, functools.partial, eval) as pool:
        found = dict(pool.answers(tasks, lose=True))
    assert isinstance(found[1], Lost)
    assert "task 1 is lost" in str(found[1])
    assert "-9" in str(found[1])
    assert [found.pop(n) for n in (0, 2, 3, 4)] == [0, 2, 3, 4]
    with Workers(2, functools.partial, eval) as pool, pytest.raises(supple.SuppleError, match="1"):
        list(pool.answers(tasks))


def test_workers_inside_of_a_worker_are_none() -> None:
    nested = "__import__('supple.workers').workers.Workers(8, str).count"
    with Workers(2, functools.partial, eval) as pool:
        assert dict(pool.answers([nested])) == {0: 1}


def test_a_function_without_a_module_is_refused_in_words() -> None:
    with pytest.raises(supple.InputError, match="top of a file"):
        Workers(2, lambda: abs)
    with Workers(2, functools.partial, eval) as pool, pytest.raises(supple.InputError):
        list(pool.answers(["lambda: 0"] * 2))


def test_a_script_that_starts_itself_again_is_told_so(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(UNGUARDED, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, tmp_path / "script.py"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode != 0
    assert 'if __name__ == "__main__"' in done.stderr.splitlines()[-1]


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_worker_outlives_its_caller(tmp_path: Path, sign: signal.Signals) -> None:
    """Ctrl-C, which the terminal sends to all of them, a request to end, and the end itself."""
    (tmp_path / "script.py").write_text(NAPS, encoding="utf-8")
    caller = subprocess.Popen(
        [sys.executable, tmp_path / "script.py"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
    )  # fmt: skip
    assert caller.stdout is not None
    with caller:
        pids = [int(caller.stdout.readline()) for _ in range(2)]
        time.sleep(0.2)
        send = os.killpg if sign == signal.SIGINT else os.kill
        send(caller.pid, sign)
        try:
            _, said = caller.communicate(timeout=60)
        finally:
            caller.kill()
    assert caller.returncode == -sign
    if sign == signal.SIGINT:
        assert said.count("Traceback") == 1, said
        assert said.rstrip().endswith("KeyboardInterrupt")
    until = time.monotonic() + 10
    while any(Path(f"/proc/{pid}").exists() for pid in pids) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)
