"""The benchmark cantilever as every peer knows it, and how a peer is asked; needs numpy alone.

Box 80 × 15 × 15 m clamped at x = 0, dead traction (0, -10, 0) Pa on x = 80, E = 3 kPa, ν = 0.3, one
load step from zero, plain Newton until the residual is 1e-10 of the load.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys

import numpy as np

LENGTH, WIDTH, TRACTION = 80.0, 15.0, -10.0
YOUNG, POISSON, TOLERANCE, MOST = 3e3, 0.3, 1e-10, 25
#: Both parameters are this many times larger in the second solve.
SECOND = 1.1
DIVISIONS = {"P1": (44, 8, 8), "P2": (17, 5, 5), "Q1": (44, 8, 8), "Q2": (29, 5, 5)}
#: Degree that the quadrature integrates: 1, 4, 8 and 27 points.
DEGREES = {"P1": 1, "P2": 2, "Q1": 3, "Q2": 5}
#: Displacement of the loaded face's centre, m: DOLFINx 0.11 and FEBio 4, which agree to 6 digits.
TIPS = {
    ("P1", "neo_hookean"): (-5.027239479839573, -25.920530984672247, 0.4953677980656953),
    ("P1", "saint_venant_kirchhoff"): (
        -5.2047873497470585,
        -25.893187570205303,
        0.5027476127170587,
    ),
    ("P2", "neo_hookean"): (-5.586975440050646, -27.254294299844197, 0.0015302842010909254),
    ("Q1", "neo_hookean"): (-5.512033333523699, -27.084478157560234, 0.0),
    ("Q1", "saint_venant_kirchhoff"): (-5.710078330369014, -27.090858781927068, 0.0),
    ("Q2", "neo_hookean"): (-5.59800624302739, -27.28646974785906, 0.0),
}


def lame(young, poisson):
    """μ and λ, Pa."""
    return young / 2 / (1 + poisson), young * poisson / (1 + poisson) / (1 - 2 * poisson)


def parameters(second=False):
    """E, Pa, and ν of the first or of the second solve."""
    factor = SECOND if second else 1.0
    return YOUNG * factor, POISSON * factor


def tip(points, u):
    """Displacement (3,) of the loaded face's centre from those of the nodes (n, 3), m.

    Where no node is there, eight are around it: the face of a hexahedron of 20 nodes, whose shape
    functions at its centre are -1/4 at corners and 1/2 between them.
    """
    distance = np.linalg.norm(points - [LENGTH, WIDTH / 2, WIDTH / 2], axis=1)
    if distance.min() < 1e-9:
        return u[distance.argmin()]
    near = np.argsort(distance, kind="stable")[:8]
    return 0.5 * u[near[:4]].sum(axis=0) - 0.25 * u[near[4:]].sum(axis=0)


def serve(solve):
    """Answer each line of the input, a request in JSON, with one line: what ``solve`` returns.

    What libraries write on the standard output goes to the error stream.
    """
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    with contextlib.suppress(KeyboardInterrupt):
        for line in sys.stdin:
            print(json.dumps(solve(**json.loads(line))), file=answers, flush=True)
