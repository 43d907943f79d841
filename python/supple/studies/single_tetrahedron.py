"""A single tetrahedron, 153 times: what is drawn, and the loaded shapes.

Mazier 2022, §3.3.1 and Table 3, whose 153 parameter sets are not published. These are 17 drawn
tetrahedra (shape, size, ν, direction of gravity) × 3 laws × 3 loads. One face is held. By scaling
only the load ρ g h / E counts, h being the height over that face, so E follows from it.

A drawn tetrahedron is kept if on the way to each of its nine loaded shapes x stays stable and X a
smooth function of x: the equation R(X, x) = 0 must be solvable for X, det ∂R/∂X ≠ 0. Past that two
rest shapes have one loaded shape, and no method can tell which was drawn: Saint Venant and
Kirchhoff's law gets there by compression.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..assembly import assemble
from ..body import Body
from ..errors import ConvergenceError
from ..mesh import Mesh
from ..sensitivities import sensitivity
from ..state import State

Floats = npt.NDArray[np.float64]

TETRAHEDRA, DENSITY, GRAVITY = 17, 1000.0, 9.81
#: ρ g h / E. The free node carries a quarter of the weight.
LOADS = (0.1, 0.3, 1.0)
#: Parameters of a law that has Young's modulus, Pa, and Poisson's ratio at small strain.
LAWS: dict[str, Callable[[float, float], dict[str, Any]]] = {
    "neo_hookean": lambda young, poisson: {"young": young, "poisson": poisson},
    "saint_venant_kirchhoff": lambda young, poisson: {"young": young, "poisson": poisson},
    "mooney_rivlin": lambda young, poisson: {
        "c1": 0.2 * young / (1 + poisson),
        "c2": 0.05 * young / (1 + poisson),
        "bulk": young / (3 * (1 - 2 * poisson)),
    },
}
#: The range of ν, and of the height, m; shapes flatter than this mean ratio are drawn again.
POISSON, HEIGHT, QUALITY = (0.0, 0.49), (0.02, 0.5), 0.4
#: Load steps on the way, and the relative tolerance of every solve.
STEPS, RTOL = 20, 1e-13
CELL = np.array([[0, 1, 2, 3]])


@dataclass(frozen=True)
class Tetrahedron:
    """A drawn shape (4, 3), m, with node 3 free; its height; ν; the direction of gravity (3,)."""

    points: Floats
    height: float
    poisson: float
    direction: Floats


@dataclass(frozen=True)
class Sample:
    """One of the 153; the load is ρ g h / E."""

    number: int
    tetrahedron: Tetrahedron
    law: str
    load: float

    @property
    def young(self) -> float:
        """E, Pa."""
        return DENSITY * GRAVITY * self.tetrahedron.height / self.load

    def body(self) -> Body:
        """The tetrahedron at rest, under its load."""
        t = self.tetrahedron
        values = LAWS[self.law](self.young, t.poisson)
        body = Body(Mesh(t.points, CELL, "P1"), self.law, density=DENSITY, **values)
        return body.fix([0, 1, 2]).gravity(GRAVITY * t.direction)


def draw(seed: int = 1, tetrahedra: int = TETRAHEDRA) -> list[Sample]:
    """The samples, by tetrahedron, law and load."""
    rng, samples = np.random.default_rng(seed), list[Sample]()
    while len(samples) < tetrahedra * len(LAWS) * len(LOADS):
        shape, first = _tetrahedron(rng), len(samples)
        nine = ((law, load) for law in LAWS for load in LOADS)
        own = [Sample(first + k, shape, law, load) for k, (law, load) in enumerate(nine)]
        # By scaling, the way to the largest load goes through the states of the smaller ones.
        if all(_is_one_to_one(sample) for sample in own if sample.load == max(LOADS)):
            samples += own
    return samples


def _tetrahedron(rng: np.random.Generator) -> Tetrahedron:
    while True:
        points = rng.uniform(-1, 1, (4, 3))
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        height = float((points[3] - points[0]) @ normal / np.linalg.norm(normal))
        if height > 0 and Mesh(points, CELL, "P1").quality()[0] > QUALITY:
            break
    h = float(np.exp(rng.uniform(*np.log(HEIGHT))))
    direction = rng.normal(size=3)
    points = (points - points[0]) * (h / height)
    return Tetrahedron(points, h, rng.uniform(*POISSON), direction / np.linalg.norm(direction))


def _is_one_to_one(sample: Sample) -> bool:
    """Whether X is a smooth function of x from rest to the whole load."""
    body, state = sample.body(), None
    whole = GRAVITY * sample.tetrahedron.direction
    try:
        for step in range(1, STEPS + 1):
            state = body.gravity(step / STEPS * whole).solve(start=state, rtol=RTOL)
            if not slope_by_rest(body, state) > 0:
                return False
    except ConvergenceError:
        return False
    return True


def slope_by_rest(body: Body, state: State) -> float:
    """det -∂R/∂X at fixed x for the free node, (N/m)³: that of the stiffness at rest."""
    at_fixed_u = sensitivity(body, state, "points").toarray()
    by_x = assemble(body, state.u)[2].toarray()
    return float(np.linalg.det((by_x - at_fixed_u)[9:, 9:]))


def loaded_shape(body: Body) -> State:
    """The loaded shape, along the path from rest: a large step may end on another branch."""
    return body.solve(rtol=RTOL, load_steps=STEPS)
