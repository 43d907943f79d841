"""Bodies: parameters per cell, regions, supports, loads that add, bad input in one sentence."""

from __future__ import annotations

import numpy as np
import pytest

import supple

MESH = supple.Mesh.box((2, 2, 2), (1.0, 1.0, 1.0), "Q1")
U = 0.1 * MESH.points**2


def left(p):
    return p[:, 0] == 0


def right(p):
    return p[:, 0] == 1


def body(**values):
    return supple.Body(MESH, "neo_hookean", **values)


def test_parameters_per_cell_are_those_of_their_cells():
    """Energy is linear in young: cells one by one add up to the map."""
    young = np.arange(1.0, 9.0) * 1e3
    whole = supple.assemble(body(young=young), U)[0]
    parts = []
    for cell in range(8):
        alone = body(young=1e-9).set(where=[cell], young=young[cell])
        parts.append(supple.assemble(alone, U)[0])
    assert whole == pytest.approx(sum(parts), rel=1e-11)


def test_new_values_reach_a_body_that_was_solved():
    """Twice the modulus under twice the load: the same displacement."""
    b = body(young=1e3).fix(left).traction(right, (0.0, 0.0, -30.0))
    first = b.solve().u
    b.set(young=2e3).clear_loads().traction(right, (0.0, 0.0, -60.0))
    np.testing.assert_allclose(b.solve().u, first, atol=1e-12)


def test_regions_of_one_law_are_one_body():
    """The same law given to some cells again, with the same values, changes nothing."""
    one, two = body(young=2e3), body(young=2e3)
    two.region([1, 3], "neo_hookean", young=2e3).region([3, 4], "neo_hookean", young=2e3)
    for a, b in zip(supple.assemble(one, U), supple.assemble(two, U), strict=True):
        assert np.max(abs(a - b)) <= 1e-12 * np.max(abs(a))


def test_two_laws_in_one_body_pull_at_their_common_nodes():
    """Energy of two regions = that of each law on its cells alone."""
    mixed = supple.assemble(body(young=1e3).region([0, 1], "corotational_polar", young=5e3), U)[0]
    soft = body(young=1e3).set(where=[0, 1], young=1e-9)
    other = supple.Body(MESH, "corotational_polar", young=1e-9).set(where=[0, 1], young=5e3)
    parts = supple.assemble(soft, U)[0] + supple.assemble(other, U)[0]
    assert mixed == pytest.approx(parts, rel=1e-11)


def test_force_and_traction_add_and_gravity_sets():
    """Twice the load or the load twice; the last gravity counts; clear_loads takes all away."""
    zero = np.zeros_like(U)

    def residual(b):
        return supple.assemble(b, zero)[1]

    twice = body(density=2.0).force(right, (0, 2.0, 0)).traction(right, (4.0, 0, 0))
    again = body(density=2.0).gravity((9.0, 0, 0))
    for _ in range(2):
        again.force(right, (0, 1.0, 0)).traction(right, (2.0, 0, 0))
    again.gravity((0, 0, 0))
    np.testing.assert_allclose(residual(again), residual(twice), atol=1e-14)
    assert abs(residual(again.clear_loads())).max() < 1e-15


def test_a_row_a_node_is_as_good_as_a_force_on_each():
    nodes, zero = MESH.nodes(right), np.zeros_like(U)
    one = body().force(right, (0.0, 2.0, 0.0))
    each = body().force(nodes, np.tile([0.0, 2.0, 0.0], (len(nodes), 1)))
    np.testing.assert_array_equal(supple.assemble(one, zero)[1], supple.assemble(each, zero)[1])


def test_reactions_balance_the_loads():
    """Equilibrium of the whole body: reactions + weight + force = 0, at prescribed dofs only."""
    b = body(density=1000.0, young=1e6).fix(left).gravity((0, 0, -9.81))
    state = b.force(MESH.nodes(right), (1.0, 2.0, 3.0)).solve()
    expected = -np.array([9.0, 18.0, 27.0 - 9810.0])
    np.testing.assert_allclose(state.reactions.sum(axis=0), expected, rtol=1e-9)
    assert not state.reactions[MESH.points[:, 0] > 0].any()


def test_start_from_a_state_reaches_the_same_equilibrium():
    """From the half load, and from the answer itself, where one iteration is enough."""
    b = body(young=1e3).fix(left).traction(right, (0.0, 0.0, -30.0))
    half = b.solve()
    b.traction(right, (0.0, 0.0, -30.0))
    cold, warm = b.solve(), b.solve(start=half)
    np.testing.assert_allclose(warm.u, cold.u, atol=1e-10)
    assert b.solve(start=warm).iterations <= 2


def test_prescribed_displacements_are_met():
    """One value for all, and one a node with free components."""
    target = np.full((9, 3), np.nan)
    target[:, 0] = np.linspace(0.1, 0.2, 9)
    state = body().fix(left).prescribe(right, target).solve()
    np.testing.assert_allclose(state.u[MESH.nodes(right), 0], target[:, 0], atol=1e-15)
    assert abs(state.u[MESH.nodes(right), 1:]).max() > 1e-4
    state = body().fix(left).prescribe(right, (0.1, 0.0, -0.1)).solve()
    np.testing.assert_allclose(state.u[MESH.nodes(right)], np.tile([0.1, 0, -0.1], (9, 1)))


def test_assemble_leaves_supports_out():
    """All dofs: with and without fixed nodes the same matrix, csr, node-major."""
    from scipy.sparse import csr_array

    _, r, k = supple.assemble(body().fix(left), U)
    _, r2, k2 = supple.assemble(body(), U)
    assert isinstance(k, csr_array)
    assert k.shape == (81, 81)
    np.testing.assert_array_equal(r, r2)
    assert abs(k - k2).max() == 0


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: body(density=-1.0), supple.InputError, "density must be at least 0 kg/m³, got -1"),
        (lambda: body(density=[1.0, 2.0]), supple.InputError, "density must have shape"),
        (lambda: body(density=np.nan), supple.InputError, "density"),
        (
            lambda: supple.Body(MESH, "neo_hookean", "mixt"),
            supple.InputError,
            "formulation must be",
        ),
        (lambda: body(quadrature=0), supple.InputError, "quadrature must be a degree"),
        (
            lambda: body(quadrature=(4, "keast")),
            supple.InputError,
            "one of default, gauss_jacobi, gll, got 'keast'",
        ),
        (lambda: body().gravity(9.81), supple.InputError, "gravity must be three|g must be three"),
        (lambda: body().force(right, (1.0, 2.0)), supple.InputError, "force must be three"),
        (lambda: body().force(right, np.ones((1, 3))), supple.InputError, "force must be finite"),
        (lambda: body().traction(right, (0, 0, np.nan)), supple.InputError, "traction must be thr"),
        (lambda: body().traction(right, (0, 0, 1.0), per="area"), supple.InputError, "per must be"),
        (lambda: body().traction([0], (0, 0, 1.0)), supple.InputError, "no boundary facet"),
        (lambda: body().pressure(right, np.inf), supple.InputError, "pressure must be a number"),
        (
            lambda: body().skin(right, "neo_hookean", 0.0),
            supple.InputError,
            "thickness must be abo",
        ),
        (lambda: body().fix("base"), supple.InputError, "no tag 'base'"),
        (lambda: body().fix(lambda p: p[:, 0] > 9), supple.InputError, "no nodes chosen"),
        (lambda: body().prescribe(right, (1.0, 2.0)), supple.InputError, "u must have shape"),
        (lambda: body().set_skin(0, young=1.0), supple.InputError, r"add one by skin\(\)"),
        (lambda: body().solve(), supple.InputError, "not held: nothing resists a .*fix or support"),
        (lambda: body().fix([0, 1]).solve(), supple.InputError, "nothing resists a turn"),
        (lambda: body().rest_shape(), supple.InputError, "not held"),
        (lambda: body().fix(left).solve(rtol=2.0), supple.InputError, "rtol must lie"),
        (lambda: body().fix(left).solve(load_steps=0), supple.InputError, "load_steps must be"),
        (lambda: body().fix(left).solve(max_iterations=0), supple.InputError, "max_iterations"),
        (lambda: body().fix(left).solve(solver="lu"), supple.InputError, "solver must be"),
        (lambda: body().fix(left).rest_shape(method="x"), supple.InputError, "method must be one"),
        (lambda: body().fix(left).rest_shape(density_of="x"), supple.InputError, "density_of must"),
        (
            lambda: body().on(supple.Mesh.box((1, 1, 1), (1, 1, 1), "Q1")),
            supple.InputError,
            "moved",
        ),
        (lambda: supple.assemble(body(), np.zeros(81)), supple.InputError, "u must have shape"),
        (lambda: body().prescribe(right, (np.inf, 0, 0)), supple.InputError, "u must"),
    ],
)
def test_bad_input_says_what_to_do(make, error, says):
    """One sentence; nothing is solved."""
    with pytest.raises(error, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_wrong_meshes_never_become_bodies():
    """NaN, an inverted cell, a cell twice: refused by the mesh with the cell named."""
    points, cells = np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]]
    for p, c, says in [
        (np.where(points == 1, np.nan, points), cells, "NaN"),
        (points, [[0, 2, 1, 3]], "inverted"),
        (points, cells * 2, "repeat"),
    ]:
        with pytest.raises(supple.MeshError, match=says):
            supple.Mesh(p, c, "P1")


def test_a_body_on_a_moved_mesh_is_its_own():
    """Loads added to one do not reach the other, nor do parameters."""
    one = body(young=1e3).fix(left).traction(right, (0.0, 0.0, -30.0))
    before = one.solve().u
    two = one.on(MESH.moved(MESH.points * 1.0))
    np.testing.assert_array_equal(two.solve().u, before)
    two.traction(right, (0.0, 0.0, -30.0)).set(young=2e3).gravity((0, 0, -1.0))
    two.skin(right, "neo_hookean", thickness=1e-3).fix(right)
    np.testing.assert_array_equal(one.solve().u, before)


def test_a_rest_shape_starts_from_an_earlier_one():
    """After a change of the modulus, the shape that a cold search finds; at once where it is it."""
    b = body(young=2e3).fix(left).traction(right, (0.0, 0.0, -60.0))
    first = b.rest_shape()
    assert b.rest_shape(start=first).iterations <= 2
    b.set(young=2.2e3)
    cold, warm = b.rest_shape(), b.rest_shape(start=first)
    np.testing.assert_allclose(warm.u, cold.u, atol=1e-10)
    assert warm.iterations < cold.iterations
    with pytest.raises(supple.InputError, match="start must be a rest shape"):
        b.rest_shape(start=b.solve())


@pytest.mark.parametrize("atol", [-1.0, float("nan"), float("inf")])
def test_a_senseless_absolute_tolerance_is_refused(atol):
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean").fix(lambda p: p[:, 2] < 1e-9)
    with pytest.raises(supple.InputError, match="atol must be at least 0 N"):
        body.solve(atol=atol)


@pytest.mark.parametrize(("name", "value"), [("depth", 2.5), ("max_solves", "a")])
def test_counts_of_a_fixed_point_are_whole_numbers(name, value):
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    body = supple.Body(mesh, "neo_hookean").fix(lambda p: p[:, 2] < 1e-9)
    with pytest.raises(supple.InputError, match=f"{name} must be a whole number"):
        body.rest_shape(method="sellier-anderson", **{name: value})
