"""`--profile`: phases add up to the whole, each second counts once, advice follows the figures."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import pytest

from supple import laws
from supple.cli import main
from supple.cli._profile import Facts, advice, described_as, table
from supple.kernels import build
from supple.kernels.unit import Unit
from supple.profile import Phase, Profile, collect, phase

CASE = """
[mesh.box]
cells = [6, 2, 2]
size = [0.3, 0.1, 0.1]
[material]
law = "neo_hookean"
density = 300.0
[[fix]]
where = { x = "min" }
[gravity]
acceleration = [0.0, 0.0, -1.0]
"""
#: One core of one, a fast BLAS, P1.
PLAIN = Facts("P1", steps=1, threads=1, cores=1, gflops=50.0)


@pytest.fixture
def case(tmp_path: Path) -> str:
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    return str(tmp_path / "case.toml")


@pytest.mark.parametrize("command", ["solve", "rest-shape"])
def test_phases_add_up_to_the_whole(
    command: str, case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What no phase claims is "other", which is never below 0: nothing is counted twice."""
    begin = time.perf_counter()
    assert main([command, case, "--out", str(tmp_path / "out"), "--profile", "--json"]) == 0
    spent = time.perf_counter() - begin
    found = json.loads(capsys.readouterr().out)["profile"]
    written = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert written["profile"] == found
    assert 0 < found["seconds"] <= spent
    rows = {row["phase"]: row for row in found["phases"]}
    assert {"reading", "checks", "imports", "analysis", "assembly", "residual", "factor", "solve",
            "writing", "other"} <= set(rows)  # fmt: skip
    assert sum(row["seconds"] for row in rows.values()) == pytest.approx(found["seconds"])
    assert sum(row["share"] for row in rows.values()) == pytest.approx(1.0)
    assert min(row["seconds"] for row in rows.values()) >= 0.0
    assert rows["factor"]["calls"] >= 1
    assert found["advice"]


def test_people_get_a_table_and_only_who_asks(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", str(tmp_path / "out")]
    assert main(["solve", case, *out, "--profile"]) == 0
    said = capsys.readouterr().out
    assert "factorisation" in said
    assert "GFLOP/s" in said
    assert main(["solve", case, *out]) == 0
    assert "factorisation" not in capsys.readouterr().out
    assert "profile" not in json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))


def test_a_phase_inside_of_another_counts_once() -> None:
    with collect() as found:
        with phase("outer"):
            time.sleep(0.05)
            with phase("inner"):
                time.sleep(0.1)
        with phase("outer"):
            pass
    assert 0.05 <= found.phases["outer"].seconds < 0.1 <= found.phases["inner"].seconds
    assert (found.phases["outer"].calls, found.phases["inner"].calls) == (2, 1)
    with phase("unheard"):
        assert "unheard" not in found.phases


@pytest.mark.parametrize(("age", "name"), [(0.0, "kernels compiled"), (60.0, "kernels found")])
def test_kernels_are_compiled_or_found(
    age: float, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the age of the library says."""

    def library(*_: object) -> Path:
        (tmp_path / "kernels.so").write_text("")
        os.utime(tmp_path / "kernels.so", (time.time() - age,) * 2)
        return tmp_path / "kernels.so"

    monkeypatch.setattr(build, "library", library)
    with collect() as found:
        laws.compiled(Unit("body_force", "P1"))
    assert list(found.phases) == [name]


@pytest.mark.parametrize(
    ("phases", "facts", "words"),
    [
        ({"kernels compiled": 6.0, "factor": 1.0}, {}, ["6.0 s", "next run"]),
        ({"factor": 8.0, "assembly": 2.0}, {}, ["linear algebra takes 80 %"]),
        ({"factor": 8.0, "assembly": 2.0}, {"element": "P2"}, ["P1 cells are cheaper than P2"]),
        ({"factor": 8.0, "assembly": 2.0}, {"gflops": 8.0}, ["BLAS makes 8 GFLOP/s"]),
        ({"factor": 8.0, "assembly": 2.0}, {"solver": "direct: as asked"}, ['"auto" keeps']),
        ({"assembly": 6.0, "residual": 2.0, "factor": 2.0}, {}, ["the cells take 80 %"]),
        ({"factor": 8.0, "reading": 2.0}, {"cores": 4}, ["1 of 4 cores", "OMP_NUM_THREADS=4"]),
        ({"factor": 8.0, "reading": 2.0}, {"steps": 9}, ["9 load steps"]),
        ({"analysis": 4.0, "writing": 6.0}, {}, ["once a body", "written"]),
        ({"reading": 5.0, "checks": 5.0}, {}, [".vtu", "checked"]),
        ({"factor": 0.1}, {}, ["no phase stands out"]),
    ],
)
def test_advice_is_about_what_takes_the_time(
    phases: dict[str, float], facts: dict[str, object], words: list[str]
) -> None:
    found = Profile({name: Phase(s, 1) for name, s in phases.items()}, seconds=sum(phases.values()))
    said = described_as(found, Facts(**{**vars(PLAIN), **facts}))["advice"]
    assert all(any(word in sentence for sentence in said) for word in words), said
    if not facts:
        assert not any("cores" in sentence or "OpenBLAS" in sentence for sentence in said)


def test_the_table_has_the_costliest_phase_first() -> None:
    found = Profile({"reading": Phase(1.0, 1), "factor": Phase(3.0, 8)}, seconds=5.0)
    lines = list(table(described_as(found, PLAIN)))
    assert [line.split()[0] for line in lines[1:5]] == [
        "factorisation",
        "reading",
        "other",
        "whole",
    ]
    assert lines[1].split() == ["factorisation", "8", "3.000", "60", "%"]
    assert list(advice(found, PLAIN))
