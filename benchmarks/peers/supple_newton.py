"""Supple on the benchmark cantilever, one JSON line a request (see cantilever.py).

The body is made before the clock starts; pattern, colours, symbolic analysis and all else that
`solve` does for a new body count.
"""

from __future__ import annotations

import time

import cantilever
import numpy as np

import supple


def body_of(element: str, law: str, divisions: tuple[int, int, int]) -> supple.Body:
    """The cantilever."""
    width = cantilever.WIDTH
    mesh = supple.Mesh.box(tuple(divisions), (cantilever.LENGTH, width, width), element)
    young, poisson = cantilever.parameters()
    body = supple.Body(mesh, law, young=young, poisson=poisson)
    return body.fix(lambda x: x[:, 0] < 1e-9).traction(
        lambda x: x[:, 0] > cantilever.LENGTH - 1e-9, (0.0, cantilever.TRACTION, 0.0)
    )


def timed(body: supple.Body, solver: str) -> tuple[dict[str, object], supple.State]:
    """One solve from zero, seconds by phase."""
    begin, cpu = time.perf_counter(), time.process_time()
    state = body.solve(load_steps=1, rtol=cantilever.TOLERANCE, solver=solver)
    total, cpu = time.perf_counter() - begin, time.process_time() - cpu
    phases = {name: state.timings[name] for name in ("assembly", "factor", "solve")}
    found = cantilever.tip(body.mesh.points, state.u).tolist()
    return phases | {"total": total, "cpu": cpu, "iterations": state.iterations, "tip": found,
                     "factorisations": state.timings["factorisations"],
                     "note": state.timings.get("solver", "")}, state  # fmt: skip


def left(body: supple.Body, u: np.ndarray) -> float:
    """Residual of the free dofs at u over the load's, which is the one at zero."""
    free = body.mesh.points[:, 0] > 1e-9
    now, first = (supple.assemble(body, at)[1][free] for at in (u, np.zeros_like(u)))
    return float(np.linalg.norm(now) / np.linalg.norm(first))


def solve(
    element: str, law: str, divisions: tuple[int, int, int], solver: str, **_: object
) -> dict[str, object]:
    """First and second solve of a new body; or why there is none."""
    body = body_of(element, law, divisions)
    try:
        first, state = timed(body, solver)
    except supple.InputError as problem:
        return {"skip": str(problem)}
    young, poisson = cantilever.parameters(second=True)
    second, again = timed(body.set(young=young, poisson=poisson), solver)
    second["residual"] = left(body, again.u)
    young, poisson = cantilever.parameters()
    first["residual"] = left(body.set(young=young, poisson=poisson), state.u)
    return first | {"dofs": int(np.size(body.mesh.points)), "second": second}


if __name__ == "__main__":
    cantilever.serve(solve)
