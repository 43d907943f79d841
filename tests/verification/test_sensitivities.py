"""∂R/∂(everything that R depends on) against Richardson differences of R itself, to 1e-8."""

from __future__ import annotations

import copy
import dataclasses
from itertools import pairwise

import numpy as np
import pytest

import supple
from supple import assembly
from supple.kernels.cells import ELEMENTS
from supple.state import Rest, State

MAGNITUDE = 1e-8


def stretched(points):
    """A displacement of some 15 % strain, not affine."""
    A = np.array([[0.1, 0.06, -0.05], [0.0, -0.08, 0.1], [0.05, 0.0, 0.07]])
    return points @ A.T + 0.02 * np.sin(7 * points[:, ::-1])


def richardson(f, h):
    """f'(0) from central differences at h, h/2 and h/4: the error falls as h⁶."""
    d = [(f(h / k) - f(-h / k)) / (2 * h / k) for k in (1, 2, 4)]
    once = [(4 * fine - coarse) / 3 for coarse, fine in pairwise(d)]
    return (16 * once[1] - once[0]) / 15


class Case:
    """A loaded body with other parameters in each cell, at a state that is no equilibrium."""

    def __init__(self, distorted, element, formulation, inverse):
        self.mesh = distorted(element, (2, 1, 1))
        law = "neo_hookean" if formulation == "displacement" else "mooney_rivlin"
        skin = supple.Body(self.mesh, law, formulation=formulation, density=900.0)
        skin.set(**{p.name: p.default * np.linspace(0.8, 1.2, len(self.mesh.cells))
                    for p in supple.material(law).parameters})  # fmt: skip
        self.body = skin.gravity((1.0, 2.0, -9.0))
        self.body.skin(lambda x: x[:, 2] > 0.8, "neo_hookean", thickness=0.01, young=5e3)
        self.body.traction(lambda x: x[:, 2] > 0.8, (10.0, -20.0, 30.0))
        self.body.pressure(lambda x: x[:, 2] < 0.2, 50.0)
        self.inverse, self.u = inverse, stretched(self.mesh.points)
        mixed = formulation == "mixed"
        self.p = 100 * np.cos(3 * self.mesh.points[:, 0]) if mixed else None
        zero = np.zeros_like(self.u)
        solved = (self.u, 0, [], {}, 0.0, zero, (), self.body._description, "", self.p)
        self.at = Rest(*solved, _body=self.body) if inverse else State(*solved)

    def residual(self, body):
        flat, built = assembly.unknowns(body, self.u, self.p), assembly.system(body, self.inverse)
        flat[self.u.size :] /= built.scalar_unit
        r = built.system.residual(flat, 1.0)
        r[self.u.size :] /= built.scalar_unit
        return r

    def sensitivity(self, by, **more):
        return supple.sensitivity(self.body, self.at, by, **more).toarray()


FORMS = [
    *((e, "displacement") for e in ELEMENTS),
    ("Q1", "mean-dilatation"),
    ("P2", "mixed"),
]


@pytest.fixture(params=[pytest.param((*f, i), id=f"{f[0]}-{f[1]}-{'inverse' if i else 'direct'}",
                                     marks=() if f[0] in ("P1",) else pytest.mark.slow)
                        for f in FORMS for i in (False, True)])  # fmt: skip
def case(request, distorted):
    return Case(distorted, *request.param)


def assert_derivative(found, change, scale):
    """change(h) is R at a parameter moved by h of its size ``scale`` along one direction.

    Steps are small: a skin between taut, wrinkled and slack has a kink, which no step may cross.
    """
    expected = richardson(change, 1e-2) / scale
    assert abs(expected).max() > 0
    assert abs(found - expected).max() < MAGNITUDE * abs(expected).max()


def test_by_a_parameter_of_the_law(case):
    """One cell's parameter at a time moves only that cell's column."""
    cell = len(case.mesh.cells) - 1
    for p in supple.material(case.body._description.regions[0].law.path).parameters:
        value = case.body._description.regions[0].values[p.name][:, 0]
        own = value[cell]
        step = min(own, 0.5 - own) if p.name == "poisson" else own

        def change(h, name=p.name, value=value, step=step):
            moved = value.copy()
            moved[cell] += h * step
            return case.residual(copy.copy(case.body).set(**{name: moved}))

        found = case.sensitivity(p.name)[:, cell]
        assert_derivative(found, change, step)
        case.body.set(**{p.name: value})


@pytest.mark.parametrize("name", ["thickness", "young"])
def test_by_a_parameter_of_the_skin(case, name):
    skin = case.body._description.skins[0]
    value = skin.values[name].copy()

    def change(h):
        moved = value.copy()
        moved[0] *= 1 + h
        skin.values[name] = moved
        return case.residual(case.body)

    found = case.sensitivity(name, skin=0)[:, 0]
    assert_derivative(found, change, value[0, 0])
    skin.values[name] = value


def test_by_the_points_of_the_mesh(case):
    """∂R/∂X at fixed u, along a random direction: volumes, gradients, areas and normals."""
    d = np.random.default_rng(3).uniform(-0.1, 0.1, case.mesh.points.shape)

    def change(h):
        return case.residual(case.body.on(case.mesh.moved(case.mesh.points + h * d)))

    assert_derivative(case.sensitivity("points") @ d.ravel(), change, 1.0)


@pytest.mark.parametrize("by", ["gravity", "density", "traction", "pressure"])
def test_by_a_load(case, by):
    """R is linear in each."""
    size = {"gravity": 3, "traction": 3, "pressure": 1, "density": len(case.mesh.cells)}[by]
    d = np.random.default_rng(4).uniform(-1, 1, size)
    description = case.body._description

    def change(h):
        body = case.body.on(case.mesh)
        own = body._description
        if by == "gravity":
            own.gravity = description.gravity + h * d
        elif by == "density":
            own.density = description.density + h * d[:, None]
        else:
            loads = getattr(own, {"traction": "tractions", "pressure": "pressures"}[by])
            loads[0] = dataclasses.replace(loads[0], value=loads[0].value + h * d)
        return case.residual(body)

    assert_derivative(case.sensitivity(by) @ d, change, 1.0)


def test_an_unknown_parameter_names_the_nearest(distorted):
    body = supple.Body(distorted("P1"), "neo_hookean")
    with pytest.raises(supple.MaterialError, match="did you mean young"):
        supple.sensitivity(body, np.zeros_like(body.mesh.points), "yuong")
