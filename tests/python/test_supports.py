"""Whether a body is held, what is free if not, and how a region's compliance is shared."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels.cells import ELEMENTS
from supple.supports import node_shares, pieces, require_held

MESH = supple.Mesh.box((2, 2, 2), (1.0, 2.0, 3.0), "P1")


def fixed(*dofs):
    mask = np.zeros(MESH.points.shape, dtype=bool)
    for node, axes in dofs:
        mask[node, axes] = True
    return mask


def corner(x, y, z):
    return int(np.abs(MESH.points - [x, y, z]).sum(axis=1).argmin())


A, B, C = corner(0, 0, 0), corner(0, 0, 3), corner(1, 0, 0)


def test_three_two_one_support_holds_a_body():
    """A ball, a slot and a plane: six dofs, no more and no less."""
    require_held(MESH, fixed((A, [0, 1, 2]), (B, [0, 1]), (C, [1])), {})


@pytest.mark.parametrize(
    ("dofs", "motion"),
    [
        ([], "shift along|turn about"),
        ([(A, [0, 1, 2]), (B, [0, 1, 2])], "turn about z"),
        ([(A, [0, 1, 2]), (C, [0, 1, 2])], "turn about x"),
        ([(n, [1, 2]) for n in range(27)], "shift along x"),
    ],
)
def test_the_free_motion_is_named(dofs, motion):
    """Two points leave the turn about their line, rollers the shift along them."""
    with pytest.raises(supple.InputError, match=f"nothing resists a ({motion})"):
        require_held(MESH, fixed(*dofs), {})


def test_normals_of_a_slide_count_as_supports():
    """A plane under a body holds one shift and two turns; three more dofs are enough."""
    up = {n: np.array([0, 0, 1.0]) for n in np.flatnonzero(MESH.points[:, 2] == 0)}
    require_held(MESH, fixed((A, [0, 1]), (C, [1])), up)
    with pytest.raises(supple.InputError, match="shift along x"):
        require_held(MESH, fixed((A, [1]), (C, [1])), up)


def test_each_piece_of_a_mesh_must_be_held():
    """Two boxes apart, one clamped: the other is found and counted."""
    far = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1", origin=(5.0, 0, 0))
    two = supple.Mesh(
        np.vstack([MESH.points, far.points]), np.vstack([MESH.cells, far.cells + 27]), "P1"
    )
    assert [len(p) for p in pieces(two)] == [27, 8]
    body = supple.Body(two, "neo_hookean").fix(lambda p: p[:, 0] < 0.1)
    with pytest.raises(supple.InputError, match="a piece of 8 nodes is not held"):
        body.solve()


def test_symmetry_planes_hold_a_body_together():
    """Three planes prescribed one after another keep each other's nodes on shared edges."""
    body = supple.Body(MESH, "neo_hookean")
    for axis in range(3):
        u = np.full(3, np.nan)
        u[axis] = 0.0
        body.prescribe(MESH.points[:, axis] == 0, u)
    assert (body._fixed == (MESH.points == 0)).all()


@pytest.mark.parametrize("element", ELEMENTS)
def test_shares_of_a_region_sum_to_one_and_follow_area(element):
    """A flat side: shares are ≥ 0 and sum to 1; of degree 1, nodes of a wider strip get more."""
    mesh = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), element)
    nodes = mesh.nodes(lambda p: p[:, 2] == 0)
    share = node_shares(mesh, nodes)
    assert share.sum() == pytest.approx(1.0)
    assert (share > 0).all()
    if element in ("Q1", "Pr1"):
        middle = np.all(mesh.points[nodes] == [0.5, 0.5, 0], axis=1)
        assert share[middle] == pytest.approx(0.25)


def test_nodes_of_no_facet_cannot_share_a_region():
    """A lone node beside a side has no area; the sentence says to choose whole facets."""
    nodes = np.append(MESH.nodes(lambda p: p[:, 2] == 0), corner(1, 2, 3))
    with pytest.raises(supple.InputError, match="1 of 10 nodes belong to no boundary facet"):
        node_shares(MESH, nodes)


def test_compliance_must_be_positive():
    body = supple.Body(MESH, "neo_hookean")
    plane = supple.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(supple.InputError, match="compliance must be above 0"):
            body.slide(lambda p: p[:, 2] == 0, plane, compliance=wrong)
