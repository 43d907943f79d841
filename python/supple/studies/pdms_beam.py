"""A silicone beam that bends by 130 of its 182 mm under its own weight; and straight again.

    round bars (and a mesh given) → hang → tip beside the elastica → rest shape → how straight

Mazier et al. (2022), Engineering with Computers 38, and thesis §3: Mooney–Rivlin in u and p,
clamped at x = 0, gravity along -y. The volumetric energy there is D (J - 1)², here bulk/2 ln²J
with bulk = 2 D; at 3000 times the shear modulus they part by less than 1e-11 m.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..body import Body
from ..errors import ConvergenceError, InputError
from ..mesh import Mesh
from ..state import State
from .elastica import Bent, Cantilever, bend, unbend
from .round_bar import Sections, round_bar, sections

Floats = npt.NDArray[np.float64]
Progress = Callable[[str, float], None]

LENGTH, RADIUS, GRAVITY = 0.182, 0.00425, 9.81
C1, C2 = 101709.668, 151065.46  # Pa
YOUNG = 6 * (C1 + C2)  # incompressible, small strain
BULK = 2 * 7.965272689e8  # Pa, of the published FEniCS script; its SOFA scenes take 1e7
SOFA_BULK = 1e7
DENSITY = 965.0  # kg/m³, thesis; all published scripts and scenes have 963
SCRIPT_DENSITY = 963.0
AREA, MOMENT = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4
#: κ of a round section of an incompressible solid: Cowper (1966), J. Appl. Mech. 33.
SHEAR_FACTOR = 0.9

#: Printed |u| of the tip, m: thesis and paper; their published field's own, on Beam2k.msh.
EXPERIMENT, FENICS, ABAQUS, SOFA = 0.12768, 0.13252, 0.13271, 0.13031
PUBLISHED_FIELD = 0.1347827337637818
#: Where the experiment's tip is in the published SOFA scene: along the beam, and below it.
EXPERIMENT_TIP = (0.128, 0.11625)

#: Element, formulation, and cells (across, along) of the round bars.
MIXED = ((2, 10), (2, 20), (2, 40), (4, 40), (4, 60))
LOCKED = ((2, 10), (2, 20), (2, 40))
PLAN = (
    ("Q2L", "mixed", MIXED),
    ("P2", "mixed", MIXED),
    ("Q2", "displacement", LOCKED),
    ("P2", "displacement", LOCKED),
    ("P1", "displacement", ((2, 20), (2, 40), (4, 60))),
)


@dataclass(frozen=True)
class Tip:
    """The tip of one solve; lengths in m, |u| of the node nearest the axis, and the largest."""

    section: str
    element: str
    formulation: str
    density: float
    bulk: float
    dofs: int
    u: tuple[float, float, float]
    largest: float
    iterations: int
    seconds: float  # of processor time

    @property
    def size(self) -> float:
        return float(np.linalg.norm(self.u))


@dataclass(frozen=True)
class Inverse:
    """A rest shape from a computed loaded one: distances from the straight beam, m."""

    section: str
    method: str
    largest: float
    iterations: int
    seconds: float


@dataclass(frozen=True)
class Given:
    """A mesh of straight tetrahedra: its sections, beam theory on them, and its solves."""

    sections: Sections
    theory: Bent
    stiffer: Bent  # the elastica without stretch and shear
    tip: Tip
    back: Inverse
    published: bool  # its nodes and cells are as many as Beam2k.msh has


@dataclass(frozen=True)
class Outcome:
    """What the study found; axes are (n, 2) m, along the beam and upwards, of the finest bar."""

    tips: tuple[Tip, ...]
    variants: dict[str, Tip]
    inverses: tuple[Inverse, ...]
    given: Given | None
    axes: dict[str, Floats]


def cantilever(
    density: float = DENSITY, area: npt.ArrayLike = AREA, moment: npt.ArrayLike = MOMENT,
    thick: bool = False,
) -> Cantilever:  # fmt: skip
    """The silicone bar in beam theory; with stretch and shear if ``thick``."""
    a, i = (np.broadcast_to(v, (2,) if np.ndim(v) == 0 else np.shape(v)) for v in (area, moment))
    stiff = YOUNG * float(a.mean())
    more = {"stretching": stiff, "shearing": SHEAR_FACTOR * stiff / 3} if thick else {}
    return Cantilever(LENGTH, density * GRAVITY * a, YOUNG * i, **more)


def silicone(mesh: Mesh, formulation: str, density: float = DENSITY, bulk: float = BULK,
             quadrature: int | None = None) -> Body:  # fmt: skip
    """The beam, clamped at x = 0, under its weight."""
    body = Body(mesh, "mooney_rivlin", formulation, density, quadrature, c1=C1, c2=C2, bulk=bulk)
    return body.fix(root).gravity((0.0, -GRAVITY, 0.0))


def root(points: Floats) -> npt.NDArray[np.bool_]:
    return np.asarray(points[:, 0] < 1e-9)


def hang(body: Body, bent: Bent) -> State:
    """Equilibrium, from the shape that ``bent`` has: Newton then needs 5 iterations, not 50."""
    mesh = body.mesh
    rest = body.on(mesh).clear_loads().solve()
    return body.solve(start=replace(rest, u=_carried(bent, mesh.points) - mesh.points))


def _carried(bent: Bent, X: Floats) -> Floats:
    """Points (n, 3) carried along by the axis, their sections plane and square to it."""
    s = np.linspace(0.0, bent.length, len(bent.x))
    x, drop, angle = (np.interp(X[:, 0], s, v) for v in (bent.x, bent.drop, bent.angle))
    return np.column_stack([x + X[:, 1] * np.sin(angle), X[:, 1] * np.cos(angle) - drop, X[:, 2]])


def axis_end(mesh: Mesh) -> int:
    """The node of the free end that is nearest the axis."""
    end = np.flatnonzero(mesh.points[:, 0] > LENGTH - 1e-9)
    return int(end[np.argmin(np.hypot(*mesh.points[end, 1:].T))])


def solve(section: str, body: Body, density: float, bulk: float, bent: Bent | None) -> Any:
    """The state and its `Tip`; from zero if ``bent`` is None."""
    start = time.process_time()
    state = body.solve() if bent is None else hang(body, bent)
    d, mesh = body._description, body.mesh
    u = state.u[axis_end(mesh)]
    tip = Tip(
        section, mesh.element, d.formulation, density, bulk, mesh.points.size,
        (float(u[0]), float(u[1]), float(u[2])), float(np.linalg.norm(state.u, axis=1).max()),
        state.iterations, time.process_time() - start,
    )  # fmt: skip
    return state, tip


def straighten(section: str, body: Body, state: State, method: str = "inverse") -> Any:
    """Rest shape of the computed loaded one, and how far it is from the straight beam."""
    start = time.process_time()
    loaded = body.on(body.mesh.moved(state.points))
    rest = loaded.rest_shape(method=method)
    far = float(np.linalg.norm(rest.points - body.mesh.points, axis=1).max())
    seconds = time.process_time() - start
    return rest, Inverse(section, method, far, rest.iterations, seconds)


def given(mesh: Mesh) -> Given:
    """The study of a mesh of the beam, such as Beam2k.msh, at the density of the scripts.

    Raises:
        InputError: it does not reach from x = 0 to 182 mm, or is not made of straight tetrahedra.
    """
    low, high = mesh.points[:, 0].min(), mesh.points[:, 0].max()
    if mesh.element != "P1" or abs(low) > 1e-6 or abs(high - LENGTH) > 1e-6:
        raise InputError(
            "the mesh must be of P1 tetrahedra, in m, the beam from x = 0 to 0.182 m; "
            f"got {mesh.element} from {low:g} to {high:g} m."
        )
    cut = sections(mesh)
    bar = cantilever(SCRIPT_DENSITY, cut.area, cut.moment, thick=True)
    theory = bend(bar)
    body = silicone(mesh.elevated(), "mixed", SCRIPT_DENSITY)
    even = bend(cantilever(SCRIPT_DENSITY, cut.area.mean(), cut.moment.mean()))  # has no kinks
    state, tip = solve("given mesh", body, SCRIPT_DENSITY, BULK, even)
    back = straighten("given mesh", body, state)[1]
    counts = (len(mesh.points), len(mesh.cells)) == (2055, 7488)
    stiffer = bend(replace(bar, stretching=np.inf, shearing=np.inf))
    return Given(cut, theory, stiffer, tip, back, counts)


def run(
    mesh: Mesh | None = None, plan: Any = PLAN, progress: Progress = lambda stage, share: None
) -> Outcome:
    """The whole study; ``mesh`` is the thesis' own, or None."""
    bent = bend(cantilever())
    todo = [(e, f, n) for e, f, counts in plan for n in counts]
    tips, axes = [], {"elastica": np.column_stack([bent.x, -bent.drop])}
    for number, (element, formulation, (across, along)) in enumerate(todo):
        progress(f"{element} {formulation}", number / len(todo))
        body = silicone(round_bar(LENGTH, RADIUS, across, along, element), formulation)
        begin = None if element == "P1" else bent  # P1 locks: it stays nearly straight
        tips.append(solve("round", body, DENSITY, BULK, begin)[1])
    progress("inverse", 0.9)
    coarse = silicone(round_bar(LENGTH, RADIUS, 2, 16, "Q2L"), "mixed")
    state = solve("round", coarse, DENSITY, BULK, bent)[0]
    rest, found = straighten("round", coarse, state)
    axes["inverse"], inverses = axis(coarse.mesh, rest.points), [found]
    try:
        rest, found = straighten("round", coarse, state, "reversed-gravity")
    except ConvergenceError:  # the beam loaded upwards is far from where it was: not always found
        inverses.append(Inverse("round", "reversed-gravity", float("nan"), 0, 0.0))
    else:
        axes["reversed-gravity"] = axis(coarse.mesh, rest.points)
        inverses.append(found)
    axes["hanging"] = axis(coarse.mesh, state.points)
    found_given = None if mesh is None else given(mesh)
    return Outcome(tuple(tips), variants(), tuple(inverses), found_given, axes)


def axis(mesh: Mesh, points: Floats) -> Floats:
    """Where the nodes of the axis are (n, 2): along the beam and upwards, m."""
    nodes = np.flatnonzero(np.hypot(*mesh.points[:, 1:].T) < 1e-9)
    return points[nodes[np.argsort(mesh.points[nodes, 0])], :2]


def variants() -> dict[str, Tip]:
    """One round bar of Q2L–Q1 with one thing changed at a time."""
    bent, mesh = bend(cantilever()), round_bar(LENGTH, RADIUS, 2, 20, "Q2L")
    cases = {
        "as the study": (DENSITY, BULK),
        "density 963": (SCRIPT_DENSITY, BULK),
        "bulk ten times": (DENSITY, 10 * BULK),
        "bulk 1e7, as SOFA's": (DENSITY, SOFA_BULK),
    }
    found = {
        name: solve("round", silicone(mesh, "mixed", rho, bulk), rho, bulk, bent)[1]
        for name, (rho, bulk) in cases.items()
    }
    loose = solve("round", _loosely_held(mesh), DENSITY, BULK, bent)[1]
    return found | {"clamp free to shrink": loose}


def _loosely_held(mesh: Mesh) -> Body:
    """The end at x = 0 stays plane and upright but may change its breadth, as in beam theory."""
    body = Body(mesh, "mooney_rivlin", "mixed", DENSITY, c1=C1, c2=C2, bulk=BULK)
    free = np.nan
    side = np.argmin(np.linalg.norm(mesh.points - [0.0, 0.0, RADIUS], axis=1))
    centre = np.argmin(np.linalg.norm(mesh.points, axis=1))
    body.prescribe(root, (0.0, free, free)).prescribe([centre], (0.0, 0.0, 0.0))
    return body.prescribe([side], (free, 0.0, free)).gravity((0.0, -GRAVITY, 0.0))


def softened(displacement: float) -> float:
    """Factor of EI at which the round bar's elastica has this |u| at its tip, m."""
    from scipy.optimize import brentq

    def miss(factor: float) -> float:
        return bend(cantilever(moment=factor * MOMENT)).displacement - displacement

    return float(brentq(miss, 0.5, 2.0, xtol=1e-9))


def unbent_experiment(model: float) -> Bent:
    """What a model that hangs to |u| = ``model``, m, makes of a bar that hangs as measured."""
    seen = bend(cantilever(moment=softened(EXPERIMENT) * MOMENT))
    return unbend(cantilever(moment=softened(model) * MOMENT), seen)


def polygon(corners: int) -> tuple[float, float]:
    """Area and second moment of a regular polygon in the circle, as shares of the circle's."""
    turn = 2 * np.pi / corners
    area = corners / 2 * RADIUS**2 * np.sin(turn) / AREA
    return float(area), float(area * (2 + np.cos(turn)) / 3)
