"""What is true of the synthetic patient, as truth.json tells it: mm, LPS."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from supple.breast.phantom_anatomy import Array
from supple.breast.phantom_patient import Patient
from supple.breast.phantom_tumour import Poses, Tumour

_MM = 1e3


def describe(patient: Patient, poses: Poses, tumour: Tumour) -> dict[str, Any]:
    """Everything known of the patient, ready for JSON.

    `..._mm` positions are in the image's frame, `..._scan_mm` in the scanner's; the chest wall does
    not move in the image's frame.
    """
    misalignment = patient.misalignment
    return {
        "unit": "mm",
        "frame": "LPS",
        "tumour": _point(patient, poses, tumour.zeta) | _size(patient, poses, tumour),
        "nipples": {
            side: _point(patient, poses, np.array([dome.azimuth, dome.level, 1.0]))
            for side, dome in zip(("right", "left"), patient.anatomy.domes, strict=True)
        },
        "misalignment": {
            "meaning": "scan = rotation @ image + translation_mm",
            "rotation": misalignment.rotation.tolist(),
            "translation_mm": _mm(misalignment.translation),
            "angle_deg": float(np.rad2deg(misalignment.angle)),
        },
        "parameters": asdict(patient.tissues) | {"unit": "Pa, kg/m3, m", "law": "mooney_rivlin"},
        "anatomy_m": _anatomy(patient),
        "mesh": {"element": "Q1", "nodes": len(poses.prone), "cells": len(poses.box.hexahedra)},
        "displacement_mm": _displacement(patient, poses),
    }


def _mm(point: Array) -> list[float]:
    return [float(v) * _MM for v in point]


def _point(patient: Patient, poses: Poses, zeta: Array) -> dict[str, Any]:
    """Where one material point (3,) is, prone and supine."""
    prone, supine = (
        poses.box.interpolate(pose, zeta[None])[0] + patient.isocentre
        for pose in (poses.prone, poses.supine)
    )
    return {
        "prone_mm": _mm(prone),
        "supine_mm": _mm(supine),
        "supine_scan_mm": _mm(patient.misalignment.apply(supine)),
        "moved_mm": float(poses.motion(zeta[None])[0]) * _MM,
        "moved_after_best_rigid_mm": float(poses.motion_after_alignment(zeta[None])[0]) * _MM,
    }


def _size(patient: Patient, poses: Poses, tumour: Tumour) -> dict[str, Any]:
    """The tumour's side, size and cover."""
    return {
        "side": "left" if tumour.zeta[0] > 0 else "right",
        "diameter_mm": 2.0 * tumour.radius * _MM,
        "rest_mm": _mm(tumour.centre + patient.isocentre),
        "depth_supine_mm": float(poses.depth(poses.supine, tumour.zeta)) * _MM,
    }


def _anatomy(patient: Patient) -> dict[str, Any]:
    """The numbers that draw the rest shape, m and rad, and where its origin is in the image."""
    drawn = asdict(patient.anatomy)
    right, left = drawn.pop("domes")
    drawn["waves"] = drawn["waves"].tolist()
    return drawn | {"right": right, "left": left, "isocentre": patient.isocentre.tolist()}


def _displacement(patient: Patient, poses: Poses) -> dict[str, Any]:
    """How far the breasts' nodes move, and the patient's rest-to-pose extremes."""
    zeta = poses.box.zeta
    breast = np.max([d.profile(zeta[:, 0], zeta[:, 1]) for d in patient.anatomy.domes], axis=0)
    rest = patient.anatomy.rest(zeta)
    moved = np.linalg.norm(poses.supine - poses.prone, axis=1)[breast > 0.1]
    return {
        "prone_to_supine_mean": float(moved.mean()) * _MM,
        "prone_to_supine_max": float(moved.max()) * _MM,
        "rest_to_prone_max": float(np.linalg.norm(poses.prone - rest, axis=1).max()) * _MM,
        "rest_to_supine_max": float(np.linalg.norm(poses.supine - rest, axis=1).max()) * _MM,
    }
