"""Formulations that a body refuses: one sentence with what was expected, got and what to do."""

from __future__ import annotations

import numpy as np
import pytest

import supple


def box(element):
    return supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), element)


@pytest.mark.parametrize(("element", "formulation", "words"), [
    ("P1", "mixed", ("P2 or Q2L", "P1", "elevated")),
    ("Q2", "mixed", ("P2 or Q2L", "Q2")),
    ("P2", "mean-dilatation", ("Q1", "P2")),
    ("P1", "mixd", ("displacement", "mixed", "mean-dilatation", "mixd")),
])  # fmt: skip
def test_an_element_or_formulation_that_is_not_offered(element, formulation, words):
    with pytest.raises(supple.InputError) as caught:
        supple.Body(box(element), "mooney_rivlin", formulation)
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert message.count(". ") == 0


@pytest.mark.parametrize(("element", "formulation"), [("P2", "mixed"), ("Q1", "mean-dilatation")])
def test_a_law_that_gives_its_energy_as_a_whole(element, formulation):
    """In the body and in a region of it; the region's refusal leaves the body as it was."""
    with pytest.raises(supple.MaterialError, match=r"psi_dev and psi_vol.*neo_hookean") as caught:
        supple.Body(box(element), "neo_hookean", formulation)
    assert 'use formulation "displacement" or another law' in str(caught.value)
    body = supple.Body(box(element), "mooney_rivlin", formulation)
    before = supple.assemble(body, 0.1 * body.mesh.points**2)[1]
    with pytest.raises(supple.MaterialError, match="neo_hookean"):
        body.region([0], "neo_hookean")
    np.testing.assert_array_equal(supple.assemble(body, 0.1 * body.mesh.points**2)[1], before)


def test_pressures_where_there_are_none_or_too_few():
    """assemble() and a start of another formulation."""
    plain = supple.Body(box("P2"), "mooney_rivlin")
    mixed = supple.Body(box("P2"), "mooney_rivlin", "mixed")
    u = np.zeros_like(plain.mesh.points)
    with pytest.raises(supple.InputError, match=r"must be None.*'displacement'.*leave it out"):
        supple.assemble(plain, u, np.zeros(len(u)))
    with pytest.raises(supple.InputError, match=r"pressure must have shape \(27,\).*\(8,\)"):
        supple.assemble(mixed, u, np.zeros(8))
    with pytest.raises(supple.InputError, match=r"u must have shape \(27, 3\), got \(3,\)"):
        supple.assemble(mixed, np.zeros(3))


def test_states_start_bodies_of_the_other_formulation():
    """The same mesh and the same equilibrium: a compressible cube squeezed by a tenth."""
    states = []
    for formulation in ("displacement", "mixed"):
        body = supple.Body(box("P2"), "mooney_rivlin", formulation, bulk=2e3)
        body.fix(lambda p: p[:, 2] < 1e-9)
        body.prescribe(lambda p: p[:, 2] > 1 - 1e-9, (0.0, 0.0, -0.1))
        states.append((body, body.solve()))
    (plain, first), (mixed, second) = states
    assert abs(mixed.solve(start=first).u - second.u).max() < 1e-10
    assert abs(plain.solve(start=second).u - first.u).max() < 1e-10
