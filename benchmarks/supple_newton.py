"""Supple on the benchmark cantilever, one JSON line a request (see peers/cantilever.py).

The body is made before the clock starts; pattern, colours, symbolic analysis and all else that
`solve` does for a new body count.
"""

from __future__ import annotations

import time

import bodies
import numpy as np
from peers import cantilever

import supple


def timed(body: supple.Body, solver: str) -> tuple[dict[str, object], supple.State]:
    """One solve from zero, seconds by phase."""
    begin, cpu = time.perf_counter(), time.process_time()
    state = body.solve(load_steps=1, rtol=cantilever.TOLERANCE, solver=solver)
    total, cpu = time.perf_counter() - begin, time.process_time() - cpu
    phases = {name: state.timings[name] for name in ("assembly", "factor", "solve")}
    found = cantilever.tip(body.mesh.points, state.u).tolist()
    picked = state.timings.get("solver", "") if solver == "auto" else ""
    return phases | {"total": total, "cpu": cpu, "iterations": state.iterations, "tip": found,
                     "factorisations": state.timings["factorisations"],
                     "note": picked}, state  # fmt: skip


def left(body: supple.Body, u: np.ndarray) -> float:
    """Residual of the free dofs at u over the load's, which is the one at zero."""
    free = body.mesh.points[:, 0] > 1e-9
    now, first = (supple.assemble(body, at)[1][free] for at in (u, np.zeros_like(u)))
    return float(np.linalg.norm(now) / np.linalg.norm(first))


def solve(
    element: str, law: str, divisions: tuple[int, int, int], solver: str, second: bool, **_: object
) -> dict[str, object]:
    """First and, if asked, second solve of a new body; or why there is none."""
    body = bodies.cantilever(element, tuple(divisions), law)
    try:
        first, state = timed(body, solver)
    except supple.InputError as problem:
        return {"skip": str(problem)}
    dofs = {"dofs": int(np.size(body.mesh.points))}
    if not second:
        return first | dofs | {"residual": left(body, state.u)}
    young, poisson = cantilever.parameters(second=True)
    changed, again = timed(body.set(young=young, poisson=poisson), solver)
    changed["residual"] = left(body, again.u)
    young, poisson = cantilever.parameters()
    first["residual"] = left(body.set(young=young, poisson=poisson), state.u)
    return first | dofs | {"second": changed}


if __name__ == "__main__":
    cantilever.serve(solve)
