"""Memory: a solve of 10,000 unknowns in 300 MB with Python, and no growth over many solves."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc/self/status")

#: What the scripts share; sizes in MB of 10⁶ bytes.
COMMON = """
import json, sys
from supple import Body, Mesh

def memory(name):
    lines = open("/proc/self/status").read().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(name)) / 1e6

def beam(cells):
    mesh = Mesh.box(cells, (80.0, 15.0, 15.0), "P1")
    body = Body(mesh, "neo_hookean", young=3e3, poisson=0.3).fix(lambda p: p[:, 0] < 1e-9)
    return body.traction(lambda p: p[:, 0] > 79.999, (0.0, -10.0, 0.0))

CANTILEVER = (44, 8, 8)  # 10,935 dofs
"""
PEAK = """
state = beam(CANTILEVER).solve()
print(json.dumps({"dofs": state.u.size, "peak": memory("VmHWM"), "modules": sorted(sys.modules)}))
"""
GROWTH = """
cells, solves, each = json.loads(sys.argv[1])
body = beam(cells)
found = []
for solve in range(solves + 1):
    if solve % each == 0:
        found.append(memory("VmRSS"))
    body.set(young=3e3 + solve % 7).solve(rtol=1e-6)
    if solve % 10 == 0:
        body = body.on(body.mesh)  # a new system
print(json.dumps(found))
"""


def said(script: str, *arguments: str) -> Any:
    run = [sys.executable, "-c", COMMON + script, *arguments]
    environment = {"OMP_NUM_THREADS": "1", **os.environ}
    done = subprocess.run(run, capture_output=True, text=True, check=True, env=environment)
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def solved() -> Any:
    """What the solve of the cantilever took. The kernels are there: who makes them takes more."""
    assert said("beam((1, 1, 1)).solve(); print(0)") == 0
    return said(PEAK)


def test_a_solve_of_ten_thousand_unknowns_takes_at_most_300_megabytes(solved: Any) -> None:
    assert solved["dofs"] == 10_935
    assert solved["peak"] <= 300.0


def test_a_solve_loads_no_large_library(solved: Any) -> None:
    """None of these is needed to solve; each would cost 20 MB and more."""
    assert not {"scipy", "meshio", "matplotlib", "ufl", "ffcx"} & set(solved["modules"])


@pytest.mark.slow
@pytest.mark.parametrize(("cells", "solves", "each"), [((6, 2, 2), 1000, 100), ((44, 8, 8), 20, 5)])
def test_memory_does_not_grow_with_the_number_of_solves(
    solved: Any, cells: tuple, solves: int, each: int
) -> None:
    """After the first tenth, in which pools fill: less than 1 MB, or 2 % of what one body takes.

    A leak of one displacement field (3 kB, 87 kB) a solve would be 3 MB.
    """
    found = said(GROWTH, json.dumps([cells, solves, each]))
    assert max(found[2:]) - found[1] < max(1.0, 0.02 * found[1]), found
