"""Python's threads: they run while C++ works; two bodies at once are right; one body refuses."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import supple
from supple import Body, Mesh, assembly


def beam(cells: int, young: float) -> Body:
    mesh = Mesh.box((8 * cells, cells, cells), (0.4, 0.1, 0.1), "P1")
    made = Body(mesh, "neo_hookean", young=young, poisson=0.3, density=30.0)
    return made.fix(lambda p: p[:, 0] < 1e-9).gravity((0.0, 0.0, -9.81))


def longest_pause(work: threading.Thread) -> float:
    """Seconds in which this thread did not run, at most, while ``work`` did."""
    work.start()
    last, pause = time.perf_counter(), 0.0
    while work.is_alive():
        time.sleep(1e-3)
        now = time.perf_counter()
        last, pause = now, max(pause, now - last)
    return pause


def test_a_thread_runs_while_another_solves_and_assembles() -> None:
    """With the GIL held the loop would stand still for as long as the call to C++ takes."""
    body, finer = beam(8, 1e4), beam(16, 1e4)  # whose tangent takes long enough to be timed
    u = np.zeros(finer.mesh.points.size)
    system = assembly.system(finer).system
    system.tangent(u)  # the pattern
    for work in (lambda: system.tangent(u), lambda: body.solve(rtol=1e-3)):
        begin = time.perf_counter()
        work()
        alone = time.perf_counter() - begin
        pauses = [longest_pause(threading.Thread(target=work)) for _ in range(5)]
        assert min(pauses) < 0.5 * alone, (pauses, alone)


def test_two_bodies_at_once_in_two_threads_are_right() -> None:
    """To the last bit what each gives alone; three rounds, so that they meet in every phase."""
    bodies = [beam(2, 1e4), beam(3, 2e4)]
    alone = [body.solve(solver="direct").u for body in bodies]  # which keeps no factors
    with ThreadPoolExecutor(2) as pool:
        for _ in range(3):
            found = list(pool.map(lambda body: body.solve(solver="direct"), bodies))
            for state, u in zip(found, alone, strict=True):
                assert np.abs(state.u - u).max() <= 1e-12 * state.mesh.size


def test_one_body_in_two_threads_is_refused_and_the_first_goes_on() -> None:
    """The second would change the values that the first solves with."""
    body, inside, leave = beam(2, 1e4), threading.Event(), threading.Event()
    expected = body.solve().u

    def wait(_: object) -> None:
        inside.set()
        assert leave.wait(30)

    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(body.solve, progress=wait)
        assert inside.wait(30)
        for work in (body.solve, body.rest_shape, lambda: supple.assemble(body, expected),
                     lambda: body.solve_many([{}])):  # fmt: skip
            with pytest.raises(supple.InputError, match=r"body\.on\(body\.mesh\)"):
                work()
        copy = body.on(body.mesh).solve().u  # another body
        leave.set()
        assert np.array_equal(first.result().u, expected)
    assert np.array_equal(copy, expected)
    assert np.array_equal(body.solve().u, expected)


def test_a_body_is_free_again_after_an_error() -> None:
    body = beam(2, 1e4)

    def stop(_: object) -> None:
        raise ZeroDivisionError

    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            body.solve(progress=stop)
    assert body.solve().iterations > 0


def test_progress_cannot_use_the_body_that_is_being_solved() -> None:
    body = beam(2, 1e4)
    with pytest.raises(supple.InputError, match="asks for progress"):
        body.solve(progress=lambda _: body.solve())
