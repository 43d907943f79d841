"""Results do not depend on how many threads, of the core or of a BLAS, made them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

_REGISTER = """
import hashlib, numpy as np
from supple.registration.procedural import torso
from supple.registration.register import register
from supple.registration.synthetic import random_posture, synthetic_scan
template = torso()
scan = synthetic_scan(template, random_posture(template, "standing", 1000), 3, points=20_000)
cold = register(scan.surface, template)
warm = register(scan.surface, template, start=cold.posture)
slid = register(scan.surface, template, landmarks=scan.truth.landmarks)
whole = b"".join(np.ascontiguousarray(a).tobytes() for one in (cold, warm, slid)
                 for a in (one.points, one.covariance, one.sd, one.offset, one.fit.used))
print(hashlib.sha256(whole).hexdigest(), cold.warnings, warm.warnings)
"""

_MAKEHUMAN = """
import hashlib, sys, numpy as np
from pathlib import Path
from supple.registration.makehuman import torso
t = torso(Path(sys.argv[1]))
marks = [a for one in t.landmarks.values() for a in (one.triangle, one.barycentric)]
whole = b"".join(np.ascontiguousarray(a).tobytes() for a in
                 (t.points, t.triangles, t.weights, t.joints, t.blendshapes, *marks))
print(hashlib.sha256(whole).hexdigest())
"""


def _said(program: str, core: int, blas: int, *arguments: str) -> str:
    threads = {"OMP_NUM_THREADS": str(core), "OPENBLAS_NUM_THREADS": str(blas)}
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True,
                          text=True, check=True, env=os.environ | threads)  # fmt: skip
    return done.stdout


@pytest.mark.slow
def test_a_registration_has_the_same_bits_with_one_thread_and_two() -> None:
    """Points, covariance, deviations, offset, weights of a fit, a warm one and one to landmarks."""
    assert _said(_REGISTER, 1, 1) == _said(_REGISTER, 2, 2)


@pytest.mark.slow
def test_makehumans_torso_has_the_same_bits_with_one_blas_thread_and_two(shared: Path) -> None:
    folder = str(shared / "data" / "template_makehuman")
    assert _said(_MAKEHUMAN, 1, 1, folder) == _said(_MAKEHUMAN, 1, 2, folder)
