"""The truth's mechanics: the rest shape solved forward under prone and under supine gravity.

Nothing of it is what the pipeline later assumes: hexahedra (Q1) instead of tetrahedra, a
Mooney-Rivlin solid instead of the corotational one, and a rest shape that is known, so that no
inverse problem is solved. The chest wall does not move.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

import supple
from supple.breast.phantom_anatomy import Array
from supple.breast.phantom_mesh import Box
from supple.breast.phantom_patient import Patient
from supple.breast.phantom_tumour import Poses, Tumour

#: Gravity, m/s^2, along +y (posterior) when supine.
GRAVITY = 9.81
#: Share of the small-strain shear modulus carried by the c1 term.
_C1_SHARE = 0.7


@dataclass
class Truth:
    """The patient as a finite-element body with its states."""

    patient: Patient
    box: Box
    body: Any
    prone: Any = None
    supine: Any = None

    @property
    def poses(self) -> Poses:
        """Node positions of both states."""
        return Poses(self.box, self.prone.points, self.supine.points)

    def report(self) -> dict[str, Any]:
        """How the two last solves fared, ready for JSON."""
        states = {"prone": self.prone, "supine": self.supine}
        return {
            name: {
                "iterations": int(state.iterations),
                "seconds": float(state.timings["total"]),
                "least_volume_ratio": float(np.linalg.det(state.deformation_gradient()).min()),
            }
            for name, state in states.items()
        }


def build_truth(patient: Patient, box: Box) -> Truth:
    """The body at rest, without a tumour, held on the pectoral surface and the outer rim."""
    tissues = patient.tissues
    mesh = supple.Mesh(np.asarray(patient.anatomy.rest(box.zeta), dtype=float), box.hexahedra, "Q1")
    body = supple.Body(mesh, "mooney_rivlin", density=tissues.density)
    body.fix(box.fixed)
    body.skin(box.skin.ravel(), "neo_hookean", thickness=tissues.thickness, young=tissues.skin)
    return Truth(patient, box, body)


def solve_poses(truth: Truth, tumour: Tumour | None) -> Poses:
    """Both poses with ``tumour`` in the breast; earlier states, if any, are where it starts."""
    truth.body.set(**moduli(truth.patient, truth.box, tumour))
    truth.body.gravity((0.0, -GRAVITY, 0.0))
    truth.prone = truth.body.solve(start=truth.prone, rtol=1e-7)
    truth.body.gravity((0.0, GRAVITY, 0.0))
    truth.supine = truth.body.solve(start=truth.supine, rtol=1e-7)
    return truth.poses


def moduli(patient: Patient, box: Box, tumour: Tumour | None) -> dict[str, Array]:
    """c1, c2 and bulk modulus, Pa, of every cell: tissues mixed by their share of the cell.

    2 (c1 + c2) is the shear modulus and bulk the bulk modulus of the linear solid.
    """
    tissues, samples = patient.tissues, box.samples(3)
    points = samples.reshape(-1, 3)
    young = np.full(len(points), tissues.fat)
    young[patient.anatomy.gland_depth(points) > 0] = tissues.gland
    if tumour is not None:
        young[tumour.depth(patient.anatomy, points) > 0] = tissues.tumour
    young = young.reshape(samples.shape[:2]).mean(axis=1)
    shear = young / (2.0 * (1.0 + tissues.poisson))
    bulk = young / (3.0 * (1.0 - 2.0 * tissues.poisson))
    return {"c1": _C1_SHARE * shear / 2, "c2": (1 - _C1_SHARE) * shear / 2, "bulk": bulk}
