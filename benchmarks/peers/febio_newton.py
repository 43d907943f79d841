"""FEBio 4 on the benchmark cantilever, one JSON line a request (see cantilever.py).

The request names a .npz with the mesh (points, cells in VTK's order, nodes held, loaded facets).
Each solve is a process of FEBio's; its own timers are read from its log, so that reading the input
does not count. Full Newton (BFGS without updates, the matrix reformed each iteration), no line
search, stopped by the load factor of the residual's square. A second solve keeps nothing.

python febio_newton.py EXE THREADS
"""

import os
import re
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import cantilever
import numpy as np
from febio_input import text

#: Its log's timers by phase.
TIMERS = {"total": "Solve time", "assembly": "evaluating stiffness", "factor": "in linear solver"}


def seconds(log, name):
    """Of one of the timers in a log."""
    found = re.search(rf"{re.escape(name)}[ .]*: *[\d:]+ \(([-\d.e+]+) sec\)", log)
    if found is None:
        raise ValueError(f"FEBio's log has no timer {name!r}")
    return float(found.group(1))


def read(log, displacements, points):
    """What a log and its file of displacements tell."""
    if "N O R M A L" not in log:
        raise ValueError("FEBio ended with an error; its log: " + log[-500:])
    count = re.search(r"Total number of equilibrium iterations[ .]*: *(\d+)", log)
    rows = [line.split() for line in displacements.splitlines() if not line.startswith("*")]
    u = np.array([row[1:4] for row in rows if row], dtype=float)
    norms = re.findall(r"residual +[\d.e+-]+ +([\d.e+-]+) +[\d.e+-]+", log)
    initial = re.findall(r"residual +([\d.e+-]+) +[\d.e+-]+ +[\d.e+-]+", log)
    left = float(norms[-1]) / float(initial[0]) if norms else float("nan")  # squares
    phases = {phase: seconds(log, name) for phase, name in TIMERS.items()}
    return phases | {"solve": 0.0, "iterations": int(count.group(1)), "residual": left**0.5,
                     "tip": cantilever.tip(points, u).tolist()}  # fmt: skip


def run(exe, threads, case, element, law, second):
    """One solve by FEBio."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        given = text(case, element, law, cantilever.parameters(second))
        (work / "case.feb").write_text(given, encoding="ascii")
        environment = os.environ | {"OMP_NUM_THREADS": threads, "MKL_NUM_THREADS": threads}
        command = [exe, "-i", "case.feb", "-noconfig", "-silent", "-o", "case.log"]
        subprocess.run(command, cwd=work, env=environment, check=True, capture_output=True)
        log = (work / "case.log").read_text(encoding="utf-8", errors="replace")
        return read(log, (work / "case.disp").read_text(encoding="ascii"), case["points"])


def solve(exe, threads, element, law, mesh, second, **_):
    """First and, if asked, second solve."""
    case = dict(np.load(mesh))
    answer = run(exe, threads, case, element, law, False)
    if second:
        answer["second"] = run(exe, threads, case, element, law, True)
    return answer | {"dofs": case["points"].size, "note": "MKL Pardiso"}


if __name__ == "__main__":
    cantilever.serve(partial(solve, *sys.argv[1:]))
