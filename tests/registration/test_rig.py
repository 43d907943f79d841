"""The rig of the core against NumPy: skinning, its derivatives, and those of each energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from supple.registration.posture import Posture, posed
from supple.registration.rig import Priors, Rig, Stage, _arrays
from supple.registration.rig_settings import priors_in_core, stage_in_core, weights_in_core
from supple.registration.template import Template
from supple.registration.weights import Weights
from supple.surface import Surface

from .crude_torso import chained_posture, crude_torso, some_posture

STEP = 1e-30  # of complex steps: its square is nothing


@pytest.fixture(scope="module")
def template() -> Template:
    return crude_torso(16, 12, 6)


@pytest.fixture(scope="module")
def rig(template: Template) -> Rig:
    return Rig(template)


def complex_posture(posture: Posture, column: int) -> Posture:
    """After an imaginary step of one unknown; exp(iω) is 1 + iω to the last bit."""
    bones = len(posture.scales)
    step = np.zeros(9 * bones + len(posture.blend))
    step[column] = STEP
    parts = 1j * step[: 9 * bones].reshape(bones, 3, 3)
    turns = np.eye(3) + np.cross(np.eye(3), parts[:, 0][:, None, :])
    blend = posture.blend + 1j * step[9 * bones :]
    return Posture(
        turns @ posture.rotations, posture.translations + parts[:, 1],
        posture.scales + parts[:, 2], blend,
    )  # fmt: skip


def dual_quaternions(template: Template, posture: Posture) -> np.ndarray:
    """Kavan et al. 2007 by scipy's quaternions: another formula of the rigid part than ours."""
    from scipy.spatial.transform import Rotation

    shape = template.points + np.tensordot(posture.blend, template.blendshapes, axes=1)
    joints = template.joints
    scaled = np.einsum(
        "nk,nkd->nd", template.weights,
        posture.scales * (shape[:, None] - joints) + joints,
    )  # fmt: skip
    real = Rotation.from_matrix(posture.rotations).as_quat()
    shifts = joints + posture.translations - np.einsum("kij,kj->ki", posture.rotations, joints)
    # translation t as a dual part: ½ t q, here t as a quaternion (t, 0) in scipy's order
    dual = 0.5 * np.stack([_product(np.append(t, 0), q) for t, q in zip(shifts, real, strict=True)])
    moved = np.empty_like(shape)
    for i, row in enumerate(template.weights):
        sign = np.where(real @ real[row.argmax()] < 0, -1.0, 1.0)
        q, e = (row * sign) @ real, (row * sign) @ dual
        length = np.linalg.norm(q)
        shift = 2 * _product(e / length, q / length * [-1, -1, -1, 1])[:3]
        moved[i] = Rotation.from_quat(q).apply(scaled[i]) + shift
    return moved


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of quaternions, scalar part last."""
    vector = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
    return np.append(vector, p[3] * q[3] - p[:3] @ q[:3])


def test_vertices_are_those_of_the_thesis_formula(rig: Rig, template: Template) -> None:
    """Equations 23–25 by NumPy, for every unknown moved."""
    posture = some_posture(template, 1)
    assert abs(rig.vertices(posture) - posed(template, posture)).max() < 1e-14


def test_dual_quaternion_skinning_is_that_of_its_paper(template: Template) -> None:
    posture = some_posture(template, 2, size=3.0)
    found = Rig(template, dual_quaternion=True).vertices(posture)
    assert abs(found - dual_quaternions(template, posture)).max() < 1e-13


def test_the_jacobian_is_that_of_complex_steps(rig: Rig, template: Template) -> None:
    """Complex steps through `posed` have no rounding of their own."""
    posture = some_posture(template, 3)
    jacobian = rig.jacobian(posture)
    for column in range(jacobian.shape[1]):
        slope = posed(template, complex_posture(posture, column)).imag.ravel() / STEP
        assert abs(jacobian[:, column] - slope).max() < 1e-10, column


def test_the_spread_of_vertices_is_that_of_the_jacobian(rig: Rig, template: Template) -> None:
    """sd² = trace(J_i C J_iᵀ)/3."""
    posture = some_posture(template, 4)
    jacobian = rig.jacobian(posture).reshape(len(template.points), 3, -1)
    root = np.random.default_rng(0).standard_normal((jacobian.shape[2],) * 2)
    expected = np.sqrt(np.einsum("nij,nij->n", jacobian @ root, jacobian @ root) / 3)
    assert np.allclose(rig.vertex_sd(posture, root @ root.T), expected, rtol=1e-12)


def prior_energy(template: Template, posture: Posture, priors: Priors) -> dict[str, Any]:
    """Each term of the energy by NumPy, also for complex numbers."""
    R, s, parents = posture.rotations, posture.scales, template.parents
    above = [s[p] if p >= 0 else np.ones(3) for p in parents]
    scale = (s - np.array(above) - priors.scale_mean) / priors.scale
    at_joint, turns = [], []
    for k, p in enumerate(parents):
        if p < 0:
            continue
        arm = template.joints[k] - template.joints[p]
        carried = R[p] @ (s[p] * arm) + template.joints[p] + posture.translations[p]
        at_joint.append((template.joints[k] + posture.translations[k] - carried) / priors.joint[k])
        relative = R[p].T @ R[k]
        angle = np.arccos((np.trace(relative) - 1) / 2)
        odd = relative - relative.T
        axis = np.array([odd[2, 1], odd[0, 2], odd[1, 0]]) / (2 * np.sin(angle))
        turns.append((angle * axis - priors.rotation_mean[k]) / priors.rotation[k])
    offset = posture.blend - priors.blend_mean
    return {
        "scale": 0.5 * np.sum(np.square(scale)), "joint": 0.5 * np.sum(np.square(at_joint)),
        "rotation": 0.5 * np.sum(np.square(turns)),
        "blendshape": 0.5 * offset @ np.linalg.solve(priors.blend_covariance, offset),
    }  # fmt: skip


def row_energy(evaluation: Any, rows: slice, vertices: np.ndarray) -> Any:
    """½ Σ w ρ(r) with Geman–McClure's loss."""
    at = np.einsum("rc,rcd->rd", evaluation.share[rows], vertices[evaluation.vertex[rows]])
    squared = np.sum(evaluation.direction[rows] * (at - evaluation.target[rows]), axis=1) ** 2
    loss = evaluation.loss[rows] ** 2
    robust = np.where(loss > 0, squared * loss / np.where(loss > 0, loss + squared, 1), squared)
    return 0.5 * evaluation.weight[rows] @ robust


@pytest.fixture(scope="module")
def priors(template: Template) -> Priors:
    rng = np.random.default_rng(5)
    bones, shapes = len(template.bones), len(template.blendshapes)
    root = rng.standard_normal((shapes, shapes))
    return Priors(
        scale=rng.uniform(0.05, 0.2, (bones, 3)), joint=rng.uniform(1e-3, 5e-3, bones),
        scale_mean=rng.normal(0.0, 0.1, (bones, 3)), rotation=rng.uniform(0.2, 0.8, (bones, 3)),
        rotation_mean=rng.normal(0.0, 0.3, (bones, 3)), blend_mean=rng.standard_normal(shapes),
        blend_covariance=root @ root.T + np.eye(shapes),
    )  # fmt: skip


@pytest.fixture(scope="module")
def evaluation(rig: Rig, template: Template, priors: Priors) -> tuple[Posture, Any]:
    """All terms at a posture, with pairs of another, and three landmarks."""
    truth, posture = chained_posture(template, 6), some_posture(template, 7)
    rig.set_scan(Surface(posed(template, truth), template.triangles), thin=False)
    names = ("nipple_left", "xiphoid", "axilla_right")
    targets = template.landmark_points(posed(template, truth))
    marks = rig._landmarks({name: targets[name] for name in names}, 4e-3)
    stage = Stage(reach=0.1, loss=0.01, template_share=0.4, point_share=0.1, angle=80)
    return posture, rig._fit.evaluate(
        _arrays(Posture.rest(template)), _arrays(posture), weights_in_core(Weights()),
        priors_in_core(priors, template), stage_in_core(stage), *marks,
    )  # fmt: skip


def test_each_term_of_the_energy_is_that_of_numpy(
    template: Template, priors: Priors, evaluation: tuple[Posture, Any]
) -> None:
    posture, found = evaluation
    for name, value in prior_energy(template, posture, priors).items():
        assert getattr(found.terms, name) == pytest.approx(value, rel=1e-11), name
    vertices = posed(template, posture)
    assert found.terms.data == pytest.approx(row_energy(found, slice(0, -9), vertices), rel=1e-11)
    marks = row_energy(found, slice(-9, None), vertices)
    assert found.terms.landmark == pytest.approx(marks, rel=1e-11)
    assert len(found.weight) > 100


def test_the_gradient_is_that_of_complex_steps(
    template: Template, priors: Priors, evaluation: tuple[Posture, Any]
) -> None:
    """All terms together, each of which the test above knows."""
    posture, found = evaluation
    size = abs(found.gradient).max()
    for column in range(len(found.gradient)):
        step = complex_posture(posture, column)
        energy = sum(prior_energy(template, step, priors).values())
        energy += row_energy(found, slice(None), posed(template, step))
        assert abs(found.gradient[column] - energy.imag / STEP) < 1e-10 * size, column


def quadratic_gap(rig: Rig, template: Template, evaluation: tuple[Posture, Any]) -> float:
    posture, found = evaluation
    J = rig.jacobian(posture).reshape(len(template.points), 3, -1)
    of_rows = np.einsum("rc,rd,rcdp->rp", found.share, found.direction, J[found.vertex])
    at = np.einsum("rc,rcd->rd", found.share, posed(template, posture)[found.vertex])
    squared = np.sum(found.direction * (at - found.target), axis=1) ** 2
    loss = np.where(found.loss > 0, found.loss, np.inf) ** 2
    weight = found.weight / (1 + squared / loss) ** 2
    data = of_rows.T @ (weight[:, None] * of_rows)
    rest = found.matrix - data
    return float(np.linalg.eigvalsh(rest).min() / np.linalg.eigvalsh(found.matrix).max())


def test_the_matrix_is_that_of_the_rows_and_of_priors_that_are_convex(
    rig: Rig, template: Template, evaluation: tuple[Posture, Any]
) -> None:
    """What JᵀWJ by the dense Jacobian leaves of it is positive semidefinite, as priors are."""
    assert quadratic_gap(rig, template, evaluation) > -1e-13


def test_one_deviation_of_a_bone_is_that_of_its_three_axes(
    rig: Rig, template: Template, priors: Priors
) -> None:
    """(K,) deviations without means cost what the same ones repeated (K, 3), with means 0, do."""
    posture, zero = some_posture(template, 8), np.zeros((len(template.bones), 3))
    one = replace(priors, scale=priors.scale[:, 0], scale_mean=None,
                  rotation=priors.rotation[:, 0], rotation_mean=None)  # fmt: skip
    three = replace(priors, scale=priors.scale[:, :1] + zero, scale_mean=zero,
                    rotation=priors.rotation[:, :1] + zero, rotation_mean=zero)  # fmt: skip
    rig.set_scan(Surface(template.points, template.triangles), thin=False)
    found = [
        rig._fit.evaluate(
            _arrays(Posture.rest(template)), _arrays(posture), weights_in_core(Weights()),
            priors_in_core(some, template), stage_in_core(Stage(reach=0.1)),
            *rig._landmarks({}, 5e-3),
        ) for some in (one, three)
    ]  # fmt: skip
    assert found[0].terms.scale == found[1].terms.scale > 0
    assert found[0].terms.rotation == found[1].terms.rotation > 0
    assert np.array_equal(found[0].gradient, found[1].gradient)
