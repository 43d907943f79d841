"""Names, parameters and bounds of laws, as a user asks for them."""

from __future__ import annotations

import numpy as np
import pytest

import supple

MESH = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
SHIPPED = {"saint_venant_kirchhoff", "neo_hookean", "mooney_rivlin", "corotational_qr",
           "corotational_polar"}  # fmt: skip


def test_shipped_energies_are_found_by_name():
    """The five of the first engine at least, each with reference, units, defaults inside bounds."""
    found = {m.name: m for m in supple.materials()}
    assert set(found) >= SHIPPED
    for name, material in found.items():
        assert supple.material(name) == material
        assert len(material.reference) > 20
        for p in material.parameters:
            assert p.unit in ("Pa", "1", "m")
            assert p.kind.admits(p.default)


def test_parameters_of_neo_hookean_are_youngs_and_poissons():
    """DESIGN §3's file."""
    young, poisson = supple.material("neo_hookean").parameters
    assert (young.name, young.unit, young.default) == ("young", "Pa", 3e3)
    assert (poisson.name, poisson.unit, poisson.default) == ("poisson", "1", 0.3)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (
            lambda: supple.material("neo_hokean"),
            "no energy is called neo_hokean; did you mean neo_h",
        ),
        (lambda: supple.Body(MESH, "zzz"), "there are .*corotational_polar, .*neo_hookean"),
        (lambda: supple.Body(MESH, "neo_hookean", yuong=1.0), "yuong; did you mean young"),
        (lambda: supple.Body(MESH, "mooney_rivlin", poisson=0.3), "there are bulk, c1, c2"),
        (lambda: supple.Body(MESH, "neo_hookean", poisson=0.5), r"poisson must lie in \(-1, 0.5\)"),
        (
            lambda: supple.Body(MESH, "neo_hookean", poisson=-1.0),
            r"got -1; its law's own default is 0.3",
        ),
        (lambda: supple.Body(MESH, "neo_hookean", young=0.0), r"young must lie in \(0, inf\) Pa"),
        (lambda: supple.Body(MESH, "neo_hookean", young=-3.0), "got -3"),
        (lambda: supple.Body(MESH, "neo_hookean", young=np.nan), "got nan"),
        (lambda: supple.Body(MESH, "neo_hookean", young=[1.0] * 5 + [-2.0]), "got -2"),
        (lambda: supple.Body(MESH, "mooney_rivlin", c1=-1.0), r"c1 must lie in \[0, inf"),
        (lambda: supple.Body(MESH, "neo_hookean").set(poisson=0.7), "got 0.7"),
        (lambda: supple.Body(MESH, "neo_hookean").set(c1=1.0), "has no parameter c1"),
        (lambda: supple.Body(MESH, "neo_hookean").region([0], "neo_hookean", yong=1.0), "young"),
        (
            lambda: supple.Body(MESH, "neo_hookean").region([0], "neohookean"),
            "did you mean neo_hoo",
        ),
        (lambda: supple.Body(MESH, "neo_hookean").skin(lambda p: p[:, 0] == 0, "nh", 1e-3), "nh"),
    ],
)
def test_a_wrong_law_or_parameter_says_what_there_is(make, says):
    """Unknown names with the nearest, values with bounds and default."""
    with pytest.raises(supple.MaterialError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [[1.0, 2.0], "soft", np.ones((6, 2)), np.ones(100)])
def test_values_of_another_shape_are_refused(value):
    """One number, or one for each of the six cells."""
    with pytest.raises(supple.InputError, match="young must"):
        supple.Body(MESH, "neo_hookean", young=value)
    body = supple.Body(MESH, "neo_hookean")
    before = supple.assemble(body, 0.1 * MESH.points**2)[0]
    with pytest.raises(supple.InputError, match="young must"):
        body.set(young=value)
    assert supple.assemble(body, 0.1 * MESH.points**2)[0] == before


def test_directions_reach_the_kernels_at_length_one():
    """(2, 2, 0) is (1, 1, 0)/√2, for all cells or by cell, as a default too: same energy."""
    u = MESH.points * [0.2, 0.1, -0.1]
    unit = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    energies = [
        supple.assemble(supple.Body(MESH, "transversely_isotropic_mooney_rivlin", fibre=f), u)[0]
        for f in (unit, (2.0, 2.0, 0.0), np.outer([1e-200, 1.0, 1e200, 2.0, 3.0, 4.0], unit))
    ]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-14)
    other = supple.Body(MESH, "transversely_isotropic_mooney_rivlin", fibre=(0, 0, 1))
    assert supple.assemble(other, u)[0] != pytest.approx(energies[0], rel=1e-3)
    fibre = supple.material("holzapfel_gasser_ogden").parameters[-2].default
    assert np.linalg.norm(fibre) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("wrong", [(0, 0, 0), (1.0, np.nan, 0.0), [[1.0, 0, 0]] * 5 + [[0, 0, 0]]])
def test_a_direction_of_no_length_is_refused(wrong):
    """One sentence with what was given."""
    with pytest.raises(supple.MaterialError, match="fibre must be a direction other than"):
        supple.Body(MESH, "guccione", fibre=wrong)
