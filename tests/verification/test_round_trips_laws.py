"""Every energy × element × formulation goes to its rest shape and back, beyond 30 % strain."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.kernels.cells import ELEMENTS
from supple.kernels.unit import FORMULATIONS
from supple.laws import read_law

pytestmark = pytest.mark.usefixtures("quick_compiler")
EDGE = 0.1
LAWS = {m.name: read_law(m.path) for m in supple.materials()}
#: A skin's energy (fung_skin) makes no solid; laws with directions or vertex order make no skin.
SOLIDS = [name for name, law in LAWS.items() if law.solid]
SKINS = [name for name, law in LAWS.items() if not {"isotropic", "objective"} & law.exceptions]
#: Elements of a formulation; test_round_trips.py has the other elements, with one law.
ON = {
    "displacement": ("P1", "P2", "Q1", "Q2"),
    "mixed": ("P2", "Q2L"),
    "mean-dilatation": ("Q1",),
}
#: Units that every test run goes through; the others are slow.
QUICK = (
    *("neo_hookean.P1.inverse", "corotational_polar.P1.inverse", "hooke.P1.inverse"),
    *("holzapfel_ogden.P1.inverse", "mooney_rivlin.P2.mixed_inverse"),
    "mooney_rivlin.Q1.mean_dilatation_inverse",
    *("neo_hookean.T1.skin_inverse", "fung_skin.T1.skin_inverse"),
)


def units():
    """law.element.form of every inverse form; its direct form comes along."""
    for law in SOLIDS:
        for formulation, prefix in FORMULATIONS.items():
            if formulation == "displacement" or LAWS[law].is_split:
                for element in ON[formulation]:
                    yield _param(f"{law}.{element}.{prefix}inverse")


def _param(name):
    return pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)


def varied(parameter, spread):
    """Other values in each cell: scaled where bounds let it be, or a direction turned about z."""
    if parameter.kind.size == 1:
        scaled = parameter.default * spread
        return scaled if parameter.kind.admits(scaled) else parameter.default
    x, y, z = parameter.default
    return np.column_stack([x - spread * y, y + spread * x, z + 0.2 * spread])


def block(unit):
    """An eighth of a block, its cells of different stiffness.

    Planes of symmetry hold it: corners at a clamped base fold up before the rest reaches 30 %.
    """
    law, element, form = unit.split(".")
    formulation = next(f for f, p in FORMULATIONS.items() if form == f"{p}inverse")
    count = (2, 2, 2) if ELEMENTS[element].degree == 1 else (1, 1, 2)
    mesh = supple.Mesh.box(count, (EDGE * count[0] / 2, EDGE * count[1] / 2, EDGE), element)
    body = supple.Body(mesh, law, formulation, density=1000.0)
    spread = np.linspace(0.9, 1.1, len(mesh.cells))
    body.set(**{p.name: varied(p, spread) for p in LAWS[law].parameters})
    return body.prescribe(np.arange(len(mesh.points)), np.where(mesh.points < 1e-9, 0.0, np.nan))


def coated(unit):
    """A soft block with a skin of its law on two free sides, about as stiff as the block."""
    material = LAWS[unit.split(".")[0]]
    body = block("neo_hookean.P1.inverse")
    moduli = [p.default for p in material.parameters if p.unit == "Pa" and p.name != "bulk"]
    given = {"poisson": 0.45} if "poisson" in [p.name for p in material.parameters] else {}
    return body.skin(
        lambda p: (p[:, 0] > EDGE - 1e-9) | (p[:, 1] > EDGE - 1e-9), material.name,
        thickness=0.1 * EDGE * 3e3 / max(moduli), **given,
    )  # fmt: skip


def loaded(body, t):
    """A dead traction ``t``, Pa, on top, not along an axis, and a weight of t/10 across it."""
    body.clear_loads().gravity((0.0, t / 1e4 / EDGE, 0.0))
    return body.traction(lambda p: p[:, 2] > EDGE - 1e-9, (0.2 * t, 0.0, t))


def largest_strain(found):
    stretches = np.linalg.svd(found.deformation_gradient(), compute_uv=False)
    return abs(stretches - 1).max()


def strained(solve):
    """``solve(t, start)`` at a load that strains the worst cell by 30 to 50 %.

    From where Hooke's law holds upwards; back halfway where that was too much or too far.
    """
    low, load, start = 0.0, 1.0, None
    for _ in range(60):
        found = attempt(solve, load, start)
        strain = np.inf if found is None else largest_strain(found)
        if 0.3 <= strain <= 0.5:
            return found
        if strain > 0.5:
            load = (low + load) / 2 if low else load / 100
        else:
            low, start = load, found
            load *= min(0.35 / strain, 1.5 if strain > 0.02 else np.inf)
    raise AssertionError(f"no 30 % of strain; the largest load that could be taken is {low} Pa")


def attempt(solve, load, start):
    try:
        return solve(load, start)
    except supple.ConvergenceError:
        return None


@pytest.mark.parametrize("unit", [*units()])
def test_solids_go_there_and_back(unit):
    """rest_shape ∘ solve and solve ∘ rest_shape = identity to 1e-9 of the size."""
    there_and_back(block(unit))


@pytest.mark.parametrize("unit", [_param(f"{law}.T1.skin_inverse") for law in SKINS])
def test_skins_go_there_and_back(unit):
    """The same of a skin on a soft body; taut along the pull, wrinkled across it."""
    there_and_back(coated(unit))


def there_and_back(body):
    mesh = body.mesh
    state = strained(lambda t, start: loaded(body, t).solve(start=start))
    rest = body.on(mesh.moved(state.points)).rest_shape()
    assert abs(rest.points - mesh.points).max() <= 1e-9 * mesh.size
    rest = strained(lambda t, start: loaded(body, t).rest_shape(start=start))
    again = rest.body().solve()
    assert abs(again.points - mesh.points).max() <= 1e-9 * mesh.size
