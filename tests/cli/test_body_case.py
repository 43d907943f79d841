"""A case says exactly what the same lines of Python say, and a wrong one names its key."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from supple.case import Table, read_case
from supple.cli import _body_case, _where
from supple.errors import InputError
from supple.mesh import Mesh

BOX = "[mesh.box]\ncells = [2, 1, 1]\nsize = [0.2, 0.1, 0.1]\nelement = 'Q1'\n"


def case(tmp_path: Path, text: str) -> Table:
    file = tmp_path / "case.toml"
    file.write_text(text, encoding="utf-8")
    return read_case(file)


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    """Two cubes of 0.1 m along x: 12 nodes at x = 0, 0.1, 0.2."""
    return Mesh.box(cells=(2, 1, 1), size=(0.2, 0.1, 0.1), element="Q1")


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        ('{ x = "min" }', lambda p: p[:, 0] == 0.0),
        ('{ x = "max", y = 0 }', lambda p: (p[:, 0] == 0.2) & (p[:, 1] == 0.0)),
        ("{ x = 0.1000000001 }", lambda p: np.isclose(p[:, 0], 0.1)),
        ("{ x = [0.05, 0.2] }", lambda p: p[:, 0] > 0.05),
        ("[0, 3]", lambda p: np.isin(np.arange(len(p)), [0, 3])),
    ],
)
def test_a_place_chooses_the_nodes_that_lie_there(
    tmp_path: Path, mesh: Mesh, where: str, expected: Any
) -> None:
    chosen = _where.nodes(case(tmp_path, f"where = {where}"), mesh)
    np.testing.assert_array_equal(mesh.nodes(chosen), np.flatnonzero(expected(mesh.points)))


def test_a_place_chooses_cells_by_their_middle(tmp_path: Path, mesh: Mesh) -> None:
    chosen = _where.cells(case(tmp_path, "where = { x = [0.1, 0.2] }"), mesh)
    middles = mesh.points[mesh.cells[mesh.cell_ids(chosen)]].mean(axis=1)
    np.testing.assert_allclose(middles, [[0.15, 0.05, 0.05]], atol=1e-15)


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("3", "where must be a tag, a list of ids or a place"),
        ("[]", "where must be a tag, a list of ids or a place"),
        ("[0.5]", "where must be a tag, a list of ids or a place"),
        ("[true]", "where must be a tag, a list of ids or a place"),
        ("{ r = 0 }", "where must be a tag, a list of ids or a place"),
        ('{ x = "low" }', 'where.x must be "min", "max", a number or [low, high] in m'),
        ("{ x = [0, 1, 2] }", 'where.x must be "min", "max", a number or [low, high] in m'),
        ("{ x = 0.7 }", "where: no nodes chosen"),
        ("[99]", "where: `where` names nodes 99"),
        ('"base"', "where: the mesh has no tag 'base'"),
    ],
)
def test_a_place_that_is_none_names_its_key(
    tmp_path: Path, mesh: Mesh, where: str, message: str
) -> None:
    with pytest.raises(InputError, match=re.escape("case.toml: " + message)):
        _where.nodes(case(tmp_path, f"where = {where}"), mesh)


def test_a_fibre_is_three_numbers_in_a_case(tmp_path: Path) -> None:
    """As Python's fibre=(0, 2, 0); two numbers, or one, are refused with the key."""
    law = "[material]\nlaw = 'guccione'\nfibre = {}\nc = 900.0\n"
    made = case(tmp_path, BOX + law.format("[0, 2, 0]"))
    body, _ = _body_case.read_body(made, allow_energy_files=False)
    values = body._description.regions[0].values
    np.testing.assert_array_equal(values["fibre"], [[0.0, 1.0, 0.0]] * 2)
    np.testing.assert_array_equal(values["c"], [[900.0]] * 2)
    for wrong in ("[0, 2]", "1.0"):
        with pytest.raises(InputError, match=r"\[material\] fibre must be a list of 3 numbers"):
            _body_case.read_body(case(tmp_path, BOX + law.format(wrong)), allow_energy_files=False)


def test_formulation_and_quadrature_are_those_of_the_body(tmp_path: Path) -> None:
    """Mean dilatation with 27 points: the case's body is the one of the same line of Python."""
    text = "[material]\nlaw = 'mooney_rivlin'\nformulation = 'mean-dilatation'\nquadrature = 4\n"
    body, _ = _body_case.read_body(case(tmp_path, BOX + text), allow_energy_files=False)
    described = body._description
    assert (described.formulation, described.quadrature) == ("mean-dilatation", 4)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "formulation = 'mixed'",
            "[material]: formulation 'mixed' wants a mesh of P2 or Q2L",
        ),
        ("quadrature = 99", "[material]: quadrature must be a degree"),
        ("quadrature = 0", "[material] quadrature must be a whole number"),
    ],
)
def test_a_wrong_formulation_or_rule_names_its_table(
    tmp_path: Path, line: str, message: str
) -> None:
    text = f"{BOX}[material]\nlaw = 'mooney_rivlin'\n{line}\n"
    with pytest.raises(InputError, match=re.escape(message)):
        _body_case.read_body(case(tmp_path, text), allow_energy_files=False)
