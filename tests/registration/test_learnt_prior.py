"""A prior learnt from bodies: it finds the population that they were drawn from, and helps."""

from __future__ import annotations

import numpy as np
import pytest

from supple.errors import InputError
from supple.registration.body_prior import body_prior
from supple.registration.learnt_prior import learnt_prior
from supple.registration.posture import Posture
from supple.registration.procedural import torso
from supple.registration.synthetic_posture import attached
from supple.registration.template import Template


@pytest.fixture(scope="module")
def template() -> Template:
    return torso()


def population(template: Template, count: int) -> list[Posture]:
    """Chests longer by 0.2 ± 0.03 than the abdomen, arms likewise; first shapes 1 ± 0.2, alike."""
    random, bodies = np.random.default_rng(3), []
    kinds = [bone.name for bone in template.bones]
    for _ in range(count):
        scales = np.ones((len(kinds), 3))
        scales[1:, 2] += 0.2 + 0.03 * random.normal()
        blend = np.zeros(len(template.blendshape_names))
        blend[:2] = 1 + 0.2 * random.normal()
        turns = np.tile(np.eye(3), (len(kinds), 1, 1))
        bodies.append(attached(template, turns, scales, blend))
    return bodies


def test_many_bodies_teach_their_mean_and_deviation(template: Template) -> None:
    """400 drawn of a known population: within 4 standard errors, what is assumed counting as 1."""
    found = learnt_prior(template, population(template, 400), assumed=1.0)
    assert found.scale_mean[1] == pytest.approx([0.0, 0.0, 0.2], abs=4 * 0.03 / 20 + 0.2 / 400)
    assert found.scale[1, 2] == pytest.approx(
        0.03, abs=4 * 0.03 / np.sqrt(800) + 0.2**2 / 400 / 0.03
    )
    assert found.blend_mean[:3] == pytest.approx([1, 1, 0], abs=4 * 0.2 / 20 + 1 / 400)
    correlation = found.blend_covariance[0, 1] / found.blend_covariance[0, 0]
    assert correlation > 0.98


def test_no_more_is_learnt_than_the_bodies_say(template: Template) -> None:
    """One body, its mirror image equal, against 3 assumed: a mean of a fourth, σ² = ¾ σ₀² + …

    E[x²] = (3 σ₀² + x²)/4 and the mean x/4, so the variance is that less x²/16.
    """
    start, body = body_prior(template), population(template, 1)
    found = learnt_prior(template, body, assumed=3.0)
    x = body[0].scales[1, 2] - 1
    assert found.scale_mean[1, 2] == pytest.approx(x / 4, rel=1e-12)
    variance = (3 * start.scale[1] ** 2 + x**2) / 4 - x**2 / 16
    assert found.scale[1, 2] ** 2 == pytest.approx(variance, rel=1e-12)
    arm = [bone.name for bone in template.bones].index("arm_left")
    assert np.array_equal(found.rotation[arm], np.full(3, start.rotation[arm]))


def test_left_and_right_are_taught_alike(template: Template) -> None:
    """One body that is larger on its left only, and turns one breast outwards."""
    kinds = [bone.name for bone in template.bones]
    left, right = kinds.index("breast_left"), kinds.index("breast_right")
    scales, turns = np.ones((len(kinds), 3)), np.tile(np.eye(3), (len(kinds), 1, 1))
    scales[left] *= 1.2
    turns[left] = [[np.cos(0.1), -np.sin(0.1), 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]]
    blend = np.zeros(len(template.blendshape_names))
    blend[0] = 1.0
    found = learnt_prior(template, [attached(template, turns, scales, blend)])
    assert np.allclose(found.scale_mean[left], found.scale_mean[right], atol=1e-15)
    assert found.rotation_mean[left, 2] == pytest.approx(-found.rotation_mean[right, 2]) != 0
    assert found.blend_mean[0] == found.blend_mean[1] > 0


def test_what_teaches_nothing_is_refused(template: Template) -> None:
    body = population(template, 1)
    other = Posture(body[0].rotations, body[0].translations, body[0].scales, np.zeros(3))
    for postures in ([], [other]):
        with pytest.raises(InputError, match="postures"):
            learnt_prior(template, postures)
    with pytest.raises(InputError, match="assumed"):
        learnt_prior(template, body, assumed=0.0)
