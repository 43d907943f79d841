"""Rest shape of one block by Supple and by fenicsx-pulse: same mesh, law, load, in one run.

    block → both codes in turn, several times → errors by one forward solve → rest_peers.md

    python benchmarks/rest_peers.py --pulse VENV     (see install_pulse.sh)

Unit cube of P1 tetrahedra on a clamped base z = 0, a pressure that follows its side x = 1,
uncoupled neo-Hooke with μ = 1 kPa, κ = 3 kPa. A tetrahedron's F is constant, so both solve the same
equations and their rest shapes must agree. Each time is a cold one: what is compiled lies in the
caches, everything else is done anew; pulse's process start and imports do not count, its set-up is
told apart. Every method is asked for 1e-9 of the size.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import output

import supple

HERE = Path(__file__).parent
MU, BULK, TOLERANCE = 1e3, 3e3, 1e-9
OURS = {
    "Supple, inverse": {},
    "Supple, sellier": {"method": "sellier"},
    "Supple, sellier-anderson": {"method": "sellier-anderson"},
}
PEERS = {"pulse, PrestressProblem": "inverse", "pulse, FixedPointUnloader": "fixed-point"}


@dataclass
class Row:
    """What one method gave: seconds of each repeat; rest points (n, 3), m."""

    seconds: list[float] = field(default_factory=list)
    setup: list[float] = field(default_factory=list)
    solves: int = 0
    points: np.ndarray | None = None


def block(cells: int, pressure: float) -> supple.Body:
    """The block as loaded."""
    mesh = supple.Mesh.box((cells,) * 3, (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, HERE / "pulse_neo_hookean.py", mu=MU, bulk=BULK)
    body.fix(lambda x: x[:, 2] < 1e-9)
    return body.pressure(lambda x: x[:, 0] > 1 - 1e-9, pressure)


def ours(row: Row, body: supple.Body, how: dict[str, str]) -> None:
    """One cold rest shape by Supple."""
    begin = time.perf_counter()
    rest = body.on(body.mesh).rest_shape(**how)
    row.seconds.append(time.perf_counter() - begin)
    row.setup.append(0.0)
    row.solves, row.points = rest.solves, rest.points


def peer(row: Row, body: supple.Body, method: str, python: Path, pressure: float) -> None:
    """One cold rest shape by pulse, in its environment."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "case.npz", Path(folder) / "result.npz"
        np.savez(source, points=body.mesh.points, cells=body.mesh.cells, mu=MU, bulk=BULK,
                 pressure=pressure, tolerance=TOLERANCE)  # fmt: skip
        script = [str(python), str(HERE / "pulse_block.py"), method, str(source), str(target)]
        subprocess.run(script, check=True, stdout=subprocess.DEVNULL)
        found = np.load(target)
    row.seconds.append(float(found["solve"]))
    row.setup.append(float(found["setup"]))
    row.solves, row.points = int(found["iterations"]), body.mesh.points + found["u"]


def measure(cells: int, pressure: float, repeats: int, python: Path) -> dict[str, Row]:
    """All methods in turn; the first round fills the caches and is not counted."""
    body = block(cells, pressure)
    rows = {name: Row() for name in (*OURS, *PEERS)}
    for _ in range(repeats + 1):
        for name, how in OURS.items():
            ours(rows[name], body, how)
        for name, method in PEERS.items():
            peer(rows[name], body, method, python, pressure)
    for row in rows.values():
        del row.seconds[0], row.setup[0]
    return rows


def miss(body: supple.Body, points: np.ndarray) -> float:
    """Largest distance of a node from where it should be after a forward solve from ``points``."""
    state = body.on(body.mesh.moved(points)).solve()
    return float(np.linalg.norm(state.points - body.mesh.points, axis=1).max() / body.mesh.size)


def table(rows: dict[str, Row], body: supple.Body, machine: str) -> str:
    """Markdown."""
    exact = rows["Supple, inverse"]
    moved = float(np.abs(exact.points - body.mesh.points).max())
    lines = [
        "# Rest shape of a block under a following pressure",
        "",
        f"{machine} {body.mesh.points.size} dofs, largest displacement {moved:.3f} m.",
        "",
        "| method | forward solves | set-up, s | solve, s | all over Supple, inverse "
        "| miss after a forward solve | from Supple, inverse |",
        "|---|---|---|---|---|---|---|",
    ]
    least = statistics.median(exact.seconds)
    for name, row in rows.items():
        setup, seconds = statistics.median(row.setup), statistics.median(row.seconds)
        away = float(np.abs(row.points - exact.points).max())
        lines.append(
            f"| {name} | {row.solves or '–'} | {setup:.2f} | {seconds:.3f} | "
            f"{(setup + seconds) / least:.1f} | {miss(body, row.points):.1e} | {away:.1e} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and write."""
    parser = output.options(__doc__, repeats=3, out="out/rest_peers")
    parser.add_argument("--pulse", type=Path, required=True, help="virtual environment of pulse")
    parser.add_argument("--cells", type=int, default=8, help="along an edge")
    parser.add_argument("--pressure", type=float, default=250.0, help="Pa")
    given = parser.parse_args()
    load = os.getloadavg()[0]
    python = given.pulse / "bin" / "python"
    if not python.is_file():
        sys.exit(f"no {python}; see install_pulse.sh")
    rows = measure(given.cells, given.pressure, given.repeats, python)
    threads = os.environ.get("OMP_NUM_THREADS", "all")
    how = f"medians of {given.repeats} repeats in turn, {threads} threads"
    machine = output.machine(load, how)
    text = table(rows, block(given.cells, given.pressure), machine)
    output.write(given.out, "rest_peers", text, machine)


if __name__ == "__main__":
    main()
