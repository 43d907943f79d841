"""Torso registration: errors, failures, uncertainty and seconds over many synthetic scans.

    templates → cases (shapes × poses × pairs of templates) → rows, kept as they come → tables

A row is a line of OUT/registration.jsonl; a run that was stopped goes on where it was. Scans are
100,000 points with noise, holes and clutter (`supple.registration.synthetic`); nothing is given
to the registration but the scan. Seconds exclude reading, imports and the making of scans.
"""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path
from typing import Any

import output
import registration_peer
import registration_table


def main() -> None:
    """Run what is missing, write the table."""
    parser = output.options(__doc__, repeats=1)
    parser.add_argument("--shapes", type=int, default=100, help="random bodies a pose and pair")
    parser.add_argument("--data", type=Path, help="folder of template_makehuman")
    parser.add_argument("--pairs", nargs="*", help="of those only, as scanned-fitted")
    parser.add_argument("--warm", type=int, default=1000, help="shapes whose next frame counts too")
    parser.add_argument("--peer", type=int, default=0, help="shapes that the peer gets too")
    parser.add_argument("--table", action="store_true", help="only write the table again")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    load, kept = os.getloadavg()[0], given.out / "registration.jsonl"
    if not given.table:
        _run(given, kept)
    rows = _rows(kept)
    how = "one process; seconds of wall and of processor (all threads)"
    machine = output.machine(load, how)
    output.write(given.out, "registration", registration_table.text(rows, machine), machine)


def _run(given: Any, kept: Path) -> None:
    from supple.studies import torso_cases

    known = torso_cases.templates(given.data)
    done = {row["key"] for row in _rows(kept)}
    for case in torso_cases.plan(given.shapes, known):
        if given.pairs and f"{case.scanned}-{case.fitted}" not in given.pairs:
            continue
        if case.key not in done:
            warm = case.noise > 0 and case.shape < given.warm
            _keep(kept, _row(torso_cases.run(case, known, warm)))
        if case.shape < given.peer and case.noise > 0 and f"peer {case.key}" not in done:
            _keep(kept, registration_peer.row(case, known))


def _row(outcome: Any) -> dict[str, Any]:
    case, score = outcome.case, outcome.score
    worst, off = score.worst_landmark
    warm = outcome.warm
    return {
        "key": case.key, "pair": f"{case.scanned}→{case.fitted}", "pose": case.pose,
        "shape": case.shape, "noise_mm": 1e3 * case.noise, "surface": score.surface,
        "scan": score.scan, "landmark": score.landmark, "landmarks": dict(score.landmarks),
        "worst": worst, "worst_mm": off, "vertices": score.vertices, "beyond": score.beyond,
        "covered": score.covered, "failed": score.failed, "trusted": outcome.trustworthy,
        "warnings": list(outcome.warnings), "seconds": outcome.seconds, "cpu": outcome.cpu,
        "warm_seconds": outcome.warm_seconds, "warm_cpu": outcome.warm_cpu,
        "warm_surface": warm.surface if warm else math.nan,
        "warm_failed": warm.failed if warm else None,
        "at": time.strftime("%Y-%m-%d %H:%M"),
    }  # fmt: skip


def _keep(path: Path, row: dict[str, Any]) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


def _rows(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


if __name__ == "__main__":
    main()
