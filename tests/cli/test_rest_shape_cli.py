"""`supple rest-shape`: what it writes, what that is worth, and what it leaves where it fails."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple
from supple.cli import main
from supple.cli._body_case import read_body
from supple.cli._options_case import case_of

GRAVITY = np.array([0.0, 2.0, -9.81])
LAW = {"young": 5e3, "poisson": 0.3}
OPTIONS = ["--set", "young=5e3", "--set", "poisson=0.3", "--density", "1100", "--fix", "x=min",
           "--gravity", *map(str, GRAVITY)]  # fmt: skip

CASE = """
[mesh]
file = "bar.vtu"
[material]
law = "neo_hookean"
density = 1100.0
young = 5e3
poisson = 0.3
[[fix]]
where = "base"
[[traction]]
where = "end"
pascal = [0.0, 20.0, 10.0]
[gravity]
acceleration = [0.0, 0.0, -9.81]
"""


def bar(element: str = "P1") -> supple.Mesh:
    mesh = supple.Mesh.box((5, 2, 2), (0.05, 0.02, 0.02), element)
    base = np.flatnonzero(mesh.points[:, 0] == 0.0)
    end = mesh.boundary(lambda x: np.isclose(x[:, 0], 0.05))
    tags = {"base": supple.Tag("points", base), "end": supple.Tag("facets", end)}
    return supple.Mesh(mesh.points, mesh.cells, element, tags)


def body(mesh: supple.Mesh) -> supple.Body:
    made = supple.Body(mesh, "neo_hookean", density=1100.0, **LAW).fix("base")
    return made.gravity(GRAVITY)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    bar().write("bar.vtu")
    (tmp_path / "bar.toml").write_text(CASE, encoding="utf-8")
    return tmp_path


def result(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return read


def fields(file: Path) -> Any:
    import meshio

    return meshio.read(file)


@pytest.mark.parametrize("element", ["P1", "P2", "Q1", "Pr1"])
def test_the_rest_shape_in_the_file_goes_forward_to_the_loaded_one(
    element: str, folder: Path
) -> None:
    """Tags come along; both files hold both shapes: points and displacement."""
    bar(element).write("bar.vtu")
    assert main(["rest-shape", "bar.vtu", *OPTIONS, "--out", "out"]) == 0
    rest = supple.Mesh.read(folder / "out" / "rest.vtu")
    state = body(rest).solve()
    assert np.abs(state.u).max() > 0.005  # of 0.05 m
    np.testing.assert_allclose(state.points, bar(element).points, atol=1e-9 * 0.05)
    loaded = fields(folder / "out" / "loaded.vtu")
    np.testing.assert_array_equal(loaded.points, bar(element).points)
    to_rest = loaded.point_data["displacement to rest [m]"]
    np.testing.assert_allclose(loaded.points + to_rest, rest.points, atol=1e-15)
    check = result(folder / "out")["check"]
    assert check["passed"] is True
    assert check["largest_distance_m"] < 1e-9 * 0.05
    assert set(supple.Mesh.read(folder / "out" / "loaded.vtu").tags) == {"base", "end"}


def test_a_body_that_was_solved_comes_back_to_where_it_began(folder: Path) -> None:
    """`supple solve` and then `supple rest-shape` on what it wrote."""
    assert main(["solve", "bar.toml", "--out", "forward"]) == 0
    bar().moved(fields(folder / "forward" / "deformed.vtu").points).write("bar.vtu")
    assert main(["rest-shape", "bar.toml", "--out", "back"]) == 0
    rest = supple.Mesh.read(folder / "back" / "rest.vtu")
    np.testing.assert_allclose(rest.points, bar().points, atol=1e-9 * 0.05)


def test_the_stress_in_the_file_carries_the_weight(folder: Path) -> None:
    """∫σ:∇η on the loaded tetrahedra, by hand, is the weight ∫ρ0/J g·η at each free node.

    ∇η of a node is its opposite face's area over three volumes, inwards (divergence theorem).
    """
    assert main(["rest-shape", "bar.vtu", *OPTIONS, "--out", "out"]) == 0
    file = fields(folder / "out" / "loaded.vtu")
    cells, x = file.cells[0].data, file.points[file.cells[0].data]
    stress = file.cell_data["Cauchy stress [Pa]"][0].reshape(-1, 3, 3)
    ratio = file.cell_data["J [1]"][0]
    volume = np.linalg.det(x[:, 1:] - x[:, :1]) / 6
    force = np.zeros_like(file.points)
    for node, (a, b, c) in enumerate(((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))):
        outward = np.cross(x[:, b] - x[:, a], x[:, c] - x[:, a]) / 2
        np.add.at(force, cells[:, node], np.einsum("cij,cj->ci", stress, -outward / 3))
        np.add.at(force, cells[:, node], -np.outer(1100 / ratio * volume / 4, GRAVITY))
    held = file.points[:, 0] == 0.0
    weight = 1100 * (volume / ratio).sum() * GRAVITY
    assert np.abs(force[~held]).max() < 1e-9 * np.linalg.norm(weight)
    np.testing.assert_allclose(force[held].sum(axis=0), -weight, atol=1e-9 * 1.0)
    F = file.cell_data["F [1]"][0].reshape(-1, 3, 3)
    np.testing.assert_allclose(np.linalg.det(F), ratio, rtol=1e-12)
    old = (file.points + file.point_data["displacement to rest [m]"])[cells]
    edges_then, edges_now = old[:, 1:] - old[:, :1], x[:, 1:] - x[:, :1]
    np.testing.assert_allclose(np.einsum("cij,cej->cei", F, edges_then), edges_now, atol=1e-14)


def test_density_of_the_loaded_state_is_checked_with_that_weight(folder: Path) -> None:
    """The loaded volume's weight hangs on the supports; the round trip still closes."""
    assert main(["rest-shape", "bar.vtu", *OPTIONS, "--density-of", "loaded", "--out", "out"]) == 0
    found = result(folder / "out")
    weight = 1100 * 0.05 * 0.02 * 0.02 * GRAVITY
    np.testing.assert_allclose(found["reaction_n"], -weight, atol=1e-9)
    assert found["check"]["relative_distance"] < 1e-9


def test_options_say_what_the_same_line_of_python_says(folder: Path) -> None:
    """Law, parameters, density, formulation, rule, gravity and the solver's settings."""
    given = dict.fromkeys(("unit", "element", "gravity")) | {
        "law": "mooney_rivlin", "values": ("c1=1e3", "bulk=1e5"), "density": 900.0,
        "formulation": "mean-dilatation", "quadrature": 3, "fixed": ("base", "x=0.05:1,z=min"),
        "load_steps": 4, "rtol": 1e-9, "max_iterations": 7,
    }  # fmt: skip
    bar("Q1").write("bar.vtu")
    made, settings = read_body(case_of(Path("bar.vtu"), given), allow_energy_files=False)
    told = made._description
    assert (told.regions[0].law.name, told.formulation) == ("mooney_rivlin", "mean-dilatation")
    assert (told.quadrature, told.density[0, 0]) == (3, 900.0)
    assert (told.regions[0].values["c1"][0], told.regions[0].values["bulk"][0]) == (1e3, 1e5)
    np.testing.assert_array_equal(told.gravity, [0.0, 0.0, -9.81])
    assert settings == {"load_steps": 4, "rtol": 1e-9, "max_iterations": 7}
    x, _, z = bar("Q1").points.T
    np.testing.assert_array_equal(made._fixed.all(axis=1), (x == 0) | ((x > 0.049) & (z == 0)))


def test_a_box_holds_the_nodes_that_lie_in_it(folder: Path) -> None:
    box = ["--set", "young=5e3", "--fix", "x=0:0.011,z=min", "--fix", "x=min,y=max"]
    assert main(["rest-shape", "bar.vtu", *box, "--out", "out"]) == 0
    u = fields(folder / "out" / "loaded.vtu").point_data["displacement to rest [m]"]
    x, y, z = bar().points.T
    held = ((x < 0.0111) & (z == 0)) | ((x == 0) & (y == 0.02))
    np.testing.assert_array_equal((u == 0).all(axis=1), held)


def test_an_approximate_rest_shape_is_written_and_not_trusted(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gravity reversed misses by more than a millionth; the files are there, the code is 3."""
    command = ["rest-shape", "bar.vtu", *OPTIONS, "--method", "reversed-gravity", "--out", "out"]
    assert main(command) == 3
    assert "the given shape is no equilibrium of it" in capsys.readouterr().err
    found = result(folder / "out")
    assert found["approximate"] is True
    rest = supple.Mesh.read(folder / "out" / "rest.vtu")
    missed = np.linalg.norm(body(rest).solve().points - bar().points, axis=1).max()
    assert found["check"]["largest_distance_m"] == pytest.approx(missed, rel=1e-6)
    assert missed > 1e-4
    assert main([*command, "--no-check"]) == 0
    assert "check" not in result(folder / "out")


def test_a_failure_leaves_where_it_ended_and_no_result(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One iteration is too few: failure.json, .vtu and .png, no file of a result, exit 3.

    A good run in the same folder takes them away, and they take its files away.
    """
    command = ["rest-shape", "bar.vtu", *OPTIONS, "--out", "out"]
    assert main([*command, "--load-steps", "1", "--max-iterations", "1"]) == 3
    told = capsys.readouterr().err
    assert "supple: where it ended: " in told
    names = {"failure.json", "failure.png", "failure.vtu"}
    assert {path.name for path in (folder / "out").iterdir()} == names
    failure = json.loads((folder / "out" / "failure.json").read_text(encoding="utf-8"))
    assert failure["message"] in told
    assert failure["cause"] in failure["message"]
    assert failure["history"]
    ranks = fields(folder / "out" / "failure.vtu").cell_data["rank among the worst cells [1]"][0]
    assert failure["cells"]
    np.testing.assert_array_equal(ranks[failure["cells"]], 1 + np.arange(len(failure["cells"])))
    assert (ranks > 0).sum() == len(failure["cells"])
    assert (folder / "out" / "failure.png").read_bytes().startswith(b"\x89PNG")
    assert main(command) == 0
    written = {"loaded.vtu", "rest.vtu", "result.json"}
    assert {path.name for path in (folder / "out").iterdir()} == written
    assert main([*command, "--load-steps", "1", "--max-iterations", "1"]) == 3
    assert {path.name for path in (folder / "out").iterdir()} == names


def test_a_rest_shape_in_itself_is_refused_and_drawn(folder: Path) -> None:
    """A ring of 0.9 turns under prescribed displacements that come from one of 1.1 turns."""
    flat = supple.Mesh.box((24, 1, 1), (1.0, 0.1, 0.1))
    r = 0.25 + flat.points[:, 1]

    def ring(turns: float) -> np.ndarray:
        angle = 2 * np.pi * turns * flat.points[:, 0]
        return np.column_stack([r * np.sin(angle), r * np.cos(angle), flat.points[:, 2]])

    flat.moved(ring(0.9)).write("ring.vtu")
    lines = [
        "[mesh]\nfile = 'ring.vtu'\n[material]\nlaw = 'neo_hookean'\n[solve]\nload_steps = 8\n"
    ]
    for node, u in enumerate(ring(0.9) - ring(1.1)):
        lines.append(f"[[prescribe]]\nwhere = [{node}]\nmetre = {u.tolist()}")
    (folder / "ring.toml").write_text("\n".join(lines), encoding="utf-8")
    assert main(["rest-shape", "ring.toml", "--no-check", "--out", "out"]) == 0
    assert main(["rest-shape", "ring.toml", "--check-overlap", "--out", "out"]) == 3
    failure = json.loads((folder / "out" / "failure.json").read_text(encoding="utf-8"))
    assert failure["cause"] == "rest shape overlaps itself"
    assert failure["shape"] == "last equilibrium"
    np.testing.assert_allclose(fields(folder / "out" / "failure.vtu").points, ring(1.1), atol=1e-12)


def test_a_mesh_whose_cells_lie_in_each_other_is_told_of(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two tetrahedra on one side of the face that they share: a warning, in words and in JSON."""
    points = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0.3, 0.3, -1], [0.3, 0.3, -0.5]]) * 0.01
    supple.Mesh(points, [[0, 1, 2, 3], [0, 1, 2, 4]], "P1").write("twice.vtu")
    assert main(["rest-shape", "twice.vtu", "--fix", "z=max", "--out", "out"]) == 0
    assert "warning: cells 0, 1 lie on the same side of a facet" in capsys.readouterr().out
    (warning,) = result(folder / "out")["warnings"]
    assert "cells 0, 1" in warning


@pytest.mark.slow
def test_a_body_too_soft_for_its_load_exits_3_with_its_cause(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A hundred times too soft: no rest shape and no result; what is left says where it ended."""
    bar("Q1").write("bar.vtu")
    soft = ["--set", "young=50", "--fix", "x=min", "--json", "--out", "out"]
    assert main(["rest-shape", "bar.vtu", *soft]) == 3
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["type"] == "ConvergenceError"
    assert error["cause"] in error["message"]
    assert not (folder / "out" / "result.json").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["absent.vtu"], "supple: MESH: absent.vtu does not exist"),
        (["absent.toml"], "is not a file"),
        (["bar.toml", "--density", "900"], "--density goes with a MESH"),
        (["bar.toml", "--fix", "x=min"], "--fix goes with a MESH"),
        (["bar.toml", "--max-iterations", "9"], "--max-iterations goes with a MESH"),
        (["bar.vtu", "--set", "young"], "--set must be NAME=VALUE, such as young=3e3"),
        (["bar.vtu", "--set", "young=1", "--set", "young=2"], "--set gives young twice"),
        (
            ["bar.vtu", "--set", "yuong=3e3"],
            'supple: --set yuong: unknown parameter; did you mean "young"?',
        ),
        (
            ["bar.vtu", "--fix", "x=left"],
            "--fix must be min, max, a number or low:high in m",
        ),
        (["bar.vtu", "--fix", "r=0"], "supple: --fix must be a tag or a place such as z=min"),
        (["bar.vtu", "--fix", "x=0.9"], "supple: --fix: no nodes chosen"),
        (["bar.vtu", "--fix", "top"], "supple: --fix: the mesh has no tag 'top'"),
        (["bar.vtu", "--unit", "mm", "--fix", "base"], "got --unit mm; leave --unit out"),
        (["bar.msh", "--fix", "base"], "supple: MESH: bar.msh does not exist"),
        (["plain.vtu", "--fix", "x=min"], "pass --unit m or --unit mm"),
        (["bar.vtu", "--element", "Q1"], "supple: MESH: bar.vtu has no Q1 cells"),
        (["bar.vtu", "--law", "neohookean"], "supple: --law: material: no energy is called"),
        (["bar.vtu", "--load-steps", "0"], "supple: --load-steps must be a whole number"),
        (["bar.vtu", "--quadrature", "0"], "supple: --quadrature must be a whole number"),
        (["bar.vtu"], "the body is not held"),
    ],
)
def test_wrong_options_are_named_and_nothing_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    import meshio

    meshio.Mesh(bar().points, [("tetra", bar().cells)]).write("plain.vtu")
    before = sorted(folder.iterdir())
    assert main(["rest-shape", *arguments, "--out", "out"]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("supple: ") == 1
    assert sorted(folder.iterdir()) == before
