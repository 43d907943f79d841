"""Answers of other codes: FEBio, DOLFINx and an independent numpy solver, on the same meshes."""

from __future__ import annotations

import json

import numpy as np
import pytest

import supple

CANTILEVER = {"P1": (44, 8, 8), "P2": (17, 5, 5), "Q1": (44, 8, 8), "Q2": (29, 5, 5)}
LAWS = {"svk": "saint_venant_kirchhoff", "nh": "neo_hookean"}
TIP = np.array([80.0, 7.5, 7.5])


@pytest.fixture(scope="session")
def references(shared):
    return json.loads((shared / "reference/references.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def beam(shared):
    """The 81-node beam of tetrahedra, 15 × 15 × 80, whose axis is z."""
    return supple.Mesh.read(shared / "data/beam_sonics/beam_p1_9.vtu", unit="m")


def at_base(points):
    return abs(points[:, 2]) < 1e-9


def at_top(points):
    return points[:, 2] > 80 - 1e-9


def test_beam_of_tetrahedra_lies_where_febio_puts_it(references, beam):
    """FEBio 3.6's tet4, one point, Saint Venant–Kirchhoff, -100 N on each top node: 1e-8 m."""
    case = references["febio_tet4_svk"]
    body = supple.Body(beam, case["material"], young=case["young"], poisson=case["poisson"])
    state = body.fix(at_base).force(at_top, case["nodal_force"]).solve()
    assert abs(state.points - np.array(case["final_positions"])).max() <= 1e-8


@pytest.mark.parametrize(
    ("law", "key"),
    [
        ("saint_venant_kirchhoff", "beam_p1 (9 points in z)"),
        ("saint_venant_kirchhoff", "beam_q1 (8 Gauss points)"),
        ("neo_hookean", "beam_p1 (9 points in z)"),
    ],
)
def test_cantilever_under_2000_newton_is_that_of_numpy(references, beam, law, key):
    """‖u‖ and the largest nodal |u| of a total-Lagrangian numpy solver, to 1e-8 of each."""
    box = supple.Mesh.box((2, 2, 8), (15.0, 15.0, 80.0), "Q1", origin=(-7.5, -7.5, 0.0))
    mesh = beam if "p1" in key else box
    body = supple.Body(mesh, law, young=3e3, poisson=0.3)
    top = mesh.nodes(at_top)
    u = body.fix(at_base).force(top, (0.0, -2000.0 / len(top), 0.0)).solve(load_steps=1).u
    found = np.linalg.norm(u), np.linalg.norm(u, axis=1).max()
    expected = references["cantilever_total_force_2000"][law][key]
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_mean_dilatation_explains_the_distance_to_febio_in_table_8(references):
    """Mooney–Rivlin beam: both max |u| to 1e-9, and 10.97 % between the two formulations.

    Table 8 of the thesis has 10.92 % between its trilinear hexahedra and FEBio's, in the metric
    100 mean(|u - v| / |u|) over the nodes that move. FEBio's hexahedra of uncoupled laws are mean
    dilatation, the thesis' are not: that alone gives 10.97 %, so Table 8 measures a choice of
    element and no error of either code.
    """
    case = references["mooney_rivlin_hex8"]
    mesh = supple.Mesh.box((2, 2, 12), (15.0, 15.0, 80.0), "Q1", origin=(-7.5, -7.5, 0.0))
    found = {}
    for formulation in ("displacement", "mean-dilatation"):
        body = supple.Body(mesh, "mooney_rivlin", formulation, c1=200.0, c2=100.0, bulk=1000.0)
        body.fix(at_base).force(at_top, (0.0, -100.0, 0.0))
        u = found[formulation] = body.solve().u
        expected = case["max_u"][formulation.replace("-", "_")]
        assert np.linalg.norm(u, axis=1).max() == pytest.approx(expected, rel=1e-9)
    u, v = (found[name][~at_base(mesh.points)] for name in ("displacement", "mean-dilatation"))
    metric = 100 * np.mean(np.linalg.norm(u - v, axis=1) / np.linalg.norm(u, axis=1))
    assert metric == pytest.approx(10.97, abs=0.005)


@pytest.mark.parametrize("key", ["P1 svk", "P1 nh", "P2 nh", "Q1 svk", "Q1 nh", "Q2s nh"])
def test_cantilever_under_traction_ends_where_dolfinx_and_febio_end(shared, key):
    """Tip displacement of DOLFINx 0.11 (FEBio 4 agrees to 6 digits), its quadrature: 1e-6 m."""
    text = (shared / "reference/cantilever_traction.json").read_text(encoding="utf-8")
    expected = json.loads(text)["tip"][key]
    element, law = key.split()[0][:2], LAWS[key.split()[1]]
    mesh = supple.Mesh.box(CANTILEVER[element], (80.0, 15.0, 15.0), element)
    body = supple.Body(mesh, law, young=3e3, poisson=0.3).fix(lambda p: p[:, 0] < 1e-9)
    body.traction(lambda p: p[:, 0] > 80 - 1e-9, (0.0, -10.0, 0.0))
    u = body.solve(load_steps=1).u
    np.testing.assert_allclose(in_face(mesh, u), expected, atol=1e-6, rtol=0)


def in_face(mesh, u):
    """u (3,) at the centre of the loaded face: a node's, or interpolated in the facet around it."""
    near = np.linalg.norm(mesh.points - TIP, axis=1)
    if near.min() < 1e-9:
        return u[near.argmin()]
    for facet in mesh.boundary(lambda p: p[:, 0] > 80 - 1e-9):
        x = mesh.points[facet][:, 1:]
        shape = {"P2": _in_triangle, "Q2": _in_rectangle}[mesh.element](x, TIP[1:])
        if shape is not None:
            return shape @ u[facet]
    raise AssertionError("no facet holds the tip")


def _in_triangle(x, at):
    """Quadratic shape functions (6,) of the triangle ``x`` (6, 2), VTK order; None outside."""
    r, s = np.linalg.solve((x[1:3] - x[0]).T, at - x[0])
    a, b, c = 1 - r - s, r, s
    if min(a, b, c) < -1e-12:
        return None
    corners = [w * (2 * w - 1) for w in (a, b, c)]
    return np.array([*corners, 4 * a * b, 4 * b * c, 4 * c * a])


def _in_rectangle(x, at):
    """Serendipity shape functions (8,) of the rectangle ``x`` (8, 2), VTK order; None outside."""
    r, s = np.linalg.solve((x[[1, 3]] - x[0]).T, at - x[:4].mean(axis=0)) * 2
    if max(abs(r), abs(s)) > 1 + 1e-12:
        return None
    R, S = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    corners = (1 + R * r) * (1 + S * s) * (R * r + S * s - 1) / 4
    middles = [(1 - r * r) * (1 - s), (1 + r) * (1 - s * s), (1 - r * r) * (1 + s)]
    return np.array([*corners, *(m / 2 for m in (*middles, (1 - r) * (1 - s * s)))])
