"""`supple solve`, from files to files; what `supple` says of itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple
from supple.cli import main

BEAM = """
[mesh.box]
cells = [4, 2, 2]
size = [0.04, 0.02, 0.02]
element = "Q1"
[material]
law = "neo_hookean"
density = 1000.0
young = 3e3
poisson = 0.3
[[fix]]
where = { x = "min" }
[gravity]
acceleration = [0.0, 0.0, -9.81]
"""
WEIGHT = 1000.0 * 0.04 * 0.02 * 0.02 * 9.81


def box() -> supple.Mesh:
    return supple.Mesh.box(cells=(4, 2, 2), size=(0.04, 0.02, 0.02), element="Q1")


@pytest.fixture
def beam(tmp_path: Path) -> Path:
    case = tmp_path / "beam.toml"
    case.write_text(BEAM, encoding="utf-8")
    return case


def result(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return read


def test_the_supports_carry_the_weight(beam: Path, tmp_path: Path) -> None:
    assert main(["solve", str(beam), "--out", str(tmp_path / "out")]) == 0
    reaction = result(tmp_path / "out")["reaction_n"]
    np.testing.assert_allclose(reaction, [0.0, 0.0, WEIGHT], atol=1e-9 * WEIGHT)


def test_a_case_is_solved_as_the_same_lines_of_python(beam: Path, tmp_path: Path) -> None:
    extra = """
    [[force]]
    where = [44]
    newton = [0.0, 1e-3, 0.0]
    [[traction]]
    where = { z = "max" }
    pascal = [0.0, 5.0, 0.0]
    [[pressure]]
    where = { x = "max" }
    pascal = 20.0
    [[prescribe]]
    where = [0]
    metre = [1e-4, 0.0, 0.0]
    [[region]]
    where = { x = [0.0, 0.02] }
    law = "corotational_polar"
    young = 5e3
    [skin]
    where = { z = "min" }
    law = "neo_hookean"
    thickness = 1e-3
    young = 5e3
    [solve]
    load_steps = 2
    """
    beam.write_text(BEAM + extra, encoding="utf-8")
    assert main(["solve", str(beam), "--out", str(tmp_path / "out")]) == 0

    mesh = box()
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=3e3, poisson=0.3)
    near = mesh.points[mesh.cells].mean(axis=1)[:, 0] < 0.02
    body.region(near, "corotational_polar", young=5e3)
    body.fix(lambda x: x[:, 0] == 0.0).prescribe([0], (1e-4, 0.0, 0.0))
    body.force([44], (0.0, 1e-3, 0.0)).gravity((0.0, 0.0, -9.81))
    body.traction(lambda x: np.isclose(x[:, 2], 0.02), (0.0, 5.0, 0.0))
    body.pressure(lambda x: np.isclose(x[:, 0], 0.04), 20.0)
    body.skin(lambda x: x[:, 2] == 0.0, "neo_hookean", thickness=1e-3, young=5e3)
    state = body.solve(load_steps=2)
    written = supple.Mesh.read(tmp_path / "out" / "deformed.vtu")
    np.testing.assert_allclose(written.points, state.points, atol=1e-12)


def test_a_solve_that_does_not_converge_exits_3_and_writes_nothing(
    beam: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    beam.write_text(BEAM + "[solve]\nload_steps = 1\nmax_iterations = 1\n", encoding="utf-8")
    assert main(["solve", str(beam), "--json", "--out", str(tmp_path / "out")]) == 3
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["type"] == "ConvergenceError"
    assert error["history"]
    assert error["cause"]
    assert list(tmp_path.iterdir()) == [beam]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("young = 3e3", "yuong = 3e3", '[material] yuong: unknown key; did you mean "young"?'),
        ("young = 3e3", "mesh = 3e3", "[material] mesh: unknown key"),
        ("young = 3e3", "young = -1", "[material]"),
        ("poisson = 0.3", "poisson = 0.5", "[material]"),
        ("density = 1000.0", "density = -1000.0", "[material]"),
        ("neo_hookean", "neohookean", "[material] law: "),
        ("neo_hookean", "mine.py", "[material] law names an energy file, mine.py"),
        ("[gravity]", "[gravty]", 'gravty: unknown key; did you mean "gravity"?'),
        ("acceleration", "g", '[gravity] acceleration is missing; add it.'),
        ('x = "min"', 'x = "left"', '[fix 1] where.x must be "min", "max"'),
        ("cells = [4, 2, 2]", "cells = [4, 2, 2.5]", "[mesh.box]: cells must be"),
        ("cells = [4, 2, 2]", "cells = [4, 2, -1]", "[mesh.box]: cells must be"),
        ('"Q1"', '"Q7"', "[mesh.box]: "),
        ("[mesh.box]", "[mesh]\nfile = 'a.msh'\n[meshbox]", "[mesh] file: "),
        ('[[fix]]\nwhere = { x = "min" }', "", "nothing resists"),
    ],
)  # fmt: skip
def test_a_wrong_case_gives_one_sentence_exit_2_and_no_file(
    beam: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str
) -> None:
    assert old in BEAM
    beam.write_text(BEAM.replace(old, new), encoding="utf-8")
    assert main(["solve", str(beam), "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert message in shown.err
    assert len(shown.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == [beam]


def test_version_is_the_one_of_the_package(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"supple {supple.__version__}\n"
    assert f'version = "{supple.__version__}"' in (root / "pyproject.toml").read_text("utf-8")


def test_the_help_of_solve_shows_each_table_of_a_case_on_a_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["solve", "--help"]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert any(line.startswith("[mesh.box]") for line in lines)
    assert any(line.startswith("[gravity]") for line in lines)
