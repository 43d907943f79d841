"""Results do not depend on how many threads found them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

_SOLVE = """
import sys
import numpy as np
import supple

mesh = supple.Mesh.box(cells=(12, 5, 5), size=(0.12, 0.05, 0.05), element="P1")
body = supple.Body(mesh, "neo_hookean", density=1000.0, young=3e4, poisson=0.3)
body.fix(lambda x: x[:, 0] < 1e-9).gravity((0.0, 0.0, -9.81))
forward = body.solve()
rest = body.rest_shape()
np.savez(sys.argv[1], u=forward.u, energy=forward.energy, reactions=forward.reactions, rest=rest.u)
"""


def _solved(file: Path, threads: int) -> dict[str, np.ndarray]:
    """The fields of a process with so many threads, which OpenMP reads when it starts."""
    environment = os.environ | {"OMP_NUM_THREADS": str(threads)}
    subprocess.run([sys.executable, "-c", _SOLVE, str(file)], check=True, env=environment)
    return dict(np.load(file))


@pytest.mark.parametrize("threads", [2, 4])
def test_a_solve_comes_to_the_same_with_any_number_of_threads(tmp_path: Path, threads: int) -> None:
    """1,800 tetrahedra, enough for cells to be shared out: equal to 1e-12 of the largest entry."""
    alone, together = _solved(tmp_path / "1.npz", 1), _solved(tmp_path / "n.npz", threads)
    for name, value in alone.items():
        assert np.abs(together[name] - value).max() <= 1e-12 * np.abs(value).max(), name
