"""A registered torso's front is closed, and a body of its tetrahedra weighs what it should."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import supple
from supple import InputError
from supple.registration.fe import FrontSettings, body_mesh, closed, front
from supple.registration.posture import Posture, posed
from supple.registration.procedural import torso as procedural


@pytest.fixture(scope="module")
def registration(rotation):
    """The shipped torso, turned, moved and larger on the left: as if it had been registered."""
    template = procedural()
    rest = Posture.rest(template)
    scales = rest.scales.copy()
    scales[[bone.name for bone in template.bones].index("breast_left")] = 1.2
    posture = Posture(rest.rotations, rest.translations, scales, rest.blend)
    posture = posture.moved(rotation, np.array([0.2, -0.5, 1.0]), template.joints)
    return SimpleNamespace(template=template, points=posed(template, posture))


def enclosed(surface) -> float:
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    return float(np.einsum("td,td->", np.cross(a, b), c)) / 6


def test_the_front_is_closed_and_faces_outward(registration):
    """Two triangles at each edge, in opposite directions; Euler's number of a ball; volume > 0."""
    surface = closed(registration)
    ends = surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    directed = set(map(tuple, ends.tolist()))
    assert len(directed) == len(ends)
    assert {(b, a) for a, b in directed} == directed
    assert len(surface.points) - len(ends) // 2 + len(surface.triangles) == 2
    assert enclosed(surface) > 0


def test_its_skin_is_the_registered_skin(registration):
    """Every skin triangle lies in the template's; the chest wall lies behind by the depth."""
    from supple import Surface

    body = front(registration, FrontSettings())
    skin = Surface(registration.points, registration.template.triangles)
    nodes = np.unique(body.surface.triangles[body.part == 0])
    assert skin.closest(body.surface.points[nodes]).distance.max() < 1e-12
    wall = np.unique(body.surface.triangles[body.part == 1])
    off = skin.closest(body.surface.points[wall])
    inside = np.einsum("kd,kd->k", body.surface.points[wall] - off.point, off.normal) < 0
    assert inside.mean() > 0.99


@pytest.mark.slow
def test_its_body_in_gravity_is_held_by_its_weight(registration):
    """Reactions at the chest wall and the cut are ρ V g, whichever way the breasts move."""
    settings = FrontSettings(size=20e-3, depth=16e-3)
    mesh = body_mesh(registration, settings)
    assert set(mesh.tags) == {"skin", "chest", "cut"}
    volume = enclosed(closed(registration, settings))
    assert mesh.volume == pytest.approx(volume, rel=0.03)
    assert mesh.quality().min() > 0.1
    facets = sum(len(tag.ids) for tag in mesh.tags.values())
    assert facets == len(mesh.boundary())
    body = supple.Body(mesh, "neo_hookean", density=1000.0, young=3e3, poisson=0.45)
    body.fix("chest")
    body.fix("cut")
    body.gravity((0.0, 9.81, 0.0))
    state = body.solve()
    weight = 1000.0 * 9.81 * mesh.volume
    assert state.reactions.sum(axis=0) == pytest.approx([0, -weight, 0], abs=1e-8 * weight)
    assert 1e-3 < np.linalg.norm(state.u, axis=1).max() < 0.05


@pytest.mark.parametrize("settings", [{"margin": 0.0}, {"depth": -1e-3}, {"size": 12.0}])
def test_lengths_that_are_none_are_refused(settings):
    with pytest.raises(InputError, match=next(iter(settings))):
        FrontSettings(**settings)
