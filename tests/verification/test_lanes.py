"""Kernels in lanes against FFCx's own C, cell by cell, and lanes that do not see each other.

The plain C of the same forms is compiled without optimisation: an independent order of operations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import supple
from supple import terms
from supple.core import core
from supple.kernels import ahead, build, elements
from supple.kernels.unit import FACET_LOADS, SENSITIVITY, parse
from supple.laws import _ahead, folder, read_law

pytestmark = pytest.mark.usefixtures("quick_compiler")

#: Units that every test run compares: with and without points that differ, branches, pressures.
QUICK = ("neo_hookean.P1.direct", "neo_hookean.P2.inverse", "neo_hookean.T1.skin_direct",
         "mooney_rivlin.Q1.mean_dilatation_direct")  # fmt: skip
CELLS = 11  # a batch of eight and three


#: Laws that are compared on every element: of powers, exponentials and fibres, branches.
EVERYWHERE = ("neo_hookean", "holzapfel_ogden")


def units() -> list:
    """Every law × form on the first element that it takes, every element × form of two laws, loads.

    Laws make the graph and elements the sums over it, each by code that knows nothing of the other.
    """
    chosen, met = [], set()
    for unit in ahead.everything(folder()):
        if unit.form.endswith(SENSITIVITY) or unit.form == "mass":
            continue
        law = unit.law.stem if unit.law else ""
        if law in ("", *EVERYWHERE) or (law, unit.form) not in met or unit.name in QUICK:
            met.add((law, unit.form))
            marks = () if unit.name in QUICK else pytest.mark.slow
            chosen.append(pytest.param(unit.name, marks=marks))
    return chosen


def library(name: str, plain: bool = False) -> str:
    """Path of a unit's kernels; the plain ones without optimisation."""
    flags = build.FLAGS
    try:
        if plain:
            build.FLAGS = tuple("-O0" if f == build.OPTIMISATION[0] else f for f in flags)
        return str(build.library(replace(parse(name, folder()), plain=plain), _ahead()))
    finally:
        build.FLAGS = flags


class Cells:
    """Cells of a unit with nodes of their own, parameters of their own and a deformation each."""

    def __init__(self, name: str, seed: int = 0, stiff: bool = False) -> None:
        self.name, self.rng = name, np.random.default_rng(seed)
        parts = name.split(".")
        self.law = read_law(parts[0]) if len(parts) > 2 else None
        self.element = parts[1] if self.law else parts[-1]
        self.mixed = "mixed" in name
        corners = np.asarray(elements.scalar_element(self.element).basix_element.points)
        rest = np.zeros((CELLS, len(corners), 3))
        rest[:, :, : corners.shape[1]] = corners
        self.points = rest + 0.08 * self.rng.uniform(-1, 1, rest.shape)
        strain = 0.15 * self.rng.uniform(-1, 1, (CELLS, 3, 3))
        self.u = np.einsum("cij,cnj->cni", strain, self.points)
        self.u += 0.02 * self.rng.uniform(-1, 1, rest.shape)
        self.pressures = 4 if self.element == "P2" else 8
        self.p = self.rng.uniform(-50.0, 50.0, (CELLS, self.pressures))
        self.values = (
            {p.name: self._values(p, stiff) for p in self.law.parameters} if self.law else {}
        )

    def _values(self, p, stiff):
        if p.kind.size > 1:
            x, y, z = p.default
            turn = self.rng.uniform(-0.3, 0.3, CELLS)
            return np.column_stack([x - turn * y, y + turn * x, z + 0 * turn])
        value = p.default
        if stiff:
            value = 0.49999 if p.name == "poisson" else value * (1e4 if p.name == "bulk" else 1.0)
        spread = value * self.rng.uniform(0.8, 1.25, CELLS)
        admitted = [v if p.kind.admits(v) else value for v in spread]
        return np.array(admitted if p.name != "poisson" else [value] * CELLS)

    def tabulate(self, plain: bool, *kernels: str) -> list:
        """A of each kernel, (cells, entries)."""
        nodes = self.points.shape[1]
        numbers = np.arange(CELLS * nodes, dtype=np.int32).reshape(CELLS, nodes)
        carriers = numbers[:, : self.pressures].ravel().tolist() if self.mixed else []
        system = core().System(self.points.ravel(), carriers)
        x = self.u.ravel()
        if self.mixed:
            behind = np.arange(CELLS * self.pressures, dtype=np.int32) + CELLS * nodes
            numbers = np.hstack([numbers, behind.reshape(CELLS, -1)]).astype(np.int32)
            x = np.append(x, self.p)
        term = core().KernelTerm(library(self.name, plain), system, numbers)
        for field, size in term.fields:
            if field != "u":
                rng = np.random.default_rng(1)
                given = self.values.get(field, rng.uniform(0.5, 1.0, (CELLS, size)))
                term.set_field(field, np.ravel(given))
        return [term.tabulate(kernel, x) for kernel in kernels]

    def unknowns(self) -> np.ndarray:
        """Largest |u| of each cell, or |p|."""
        largest = abs(self.u).max(axis=(1, 2))
        return np.maximum(largest, abs(self.p).max(axis=1)) if self.mixed else largest


def has_tangent(name: str) -> bool:
    return name.count(".") > 1 or name.split(".")[0] in ("body_force_rest", *FACET_LOADS[1::2])


@pytest.mark.parametrize("unit", units())
def test_lanes_give_what_one_cell_at_a_time_gives(unit):
    """K to 1e-13 of the cell's largest entry, R to 1e-13 of max|K| max|u| + max|R|.

    At random states of some 15 % strain, with parameters as they come and nearly incompressible.
    Cells whose exponentials pass e⁴⁰ are left out: exp multiplies a relative error by its argument.
    """
    kernels = ("residual", "tangent") if has_tangent(unit) else ("residual",)
    for seed, stiff in ((0, False), (1, True)):
        cells = Cells(unit, seed, stiff)
        expected = dict(zip(kernels, cells.tabulate(True, *kernels), strict=True))
        found = dict(zip(kernels, cells.tabulate(False, *kernels), strict=True))
        scale = abs(expected["residual"]).max(axis=1)
        tame = scale < np.exp(40.0)
        assert 2 * tame.sum() >= tame.size
        if "tangent" in kernels:
            stiffness = abs(expected["tangent"]).max(axis=1)
            off = worst(found["tangent"], expected["tangent"])
            assert (off[tame] <= 1e-13 * stiffness[tame]).all()
            scale = scale + stiffness * cells.unknowns()
        off = worst(found["residual"], expected["residual"])
        assert (off[tame] <= 1e-13 * scale[tame]).all()


def worst(found, expected):
    assert np.isfinite(expected).all()
    return abs(found - expected).max(axis=1)


@pytest.mark.parametrize("unit", QUICK)
def test_a_cell_without_a_value_leaves_its_neighbours_alone(unit):
    """NaN, no volume, infinity and J < 0 in one lane: all other cells to the last bit as before."""
    names = ("residual", "tangent")
    cells = Cells(unit)
    before = cells.tabulate(False, *names)
    cells.u[1] = np.nan
    cells.points[3] = 0.0
    cells.u[4] = -2 * cells.points[4]
    cells.u[9] = np.inf
    after = cells.tabulate(False, *names)
    sound = [0, 2, 5, 6, 7, 8, 10]
    for a, b in zip(after, before, strict=True):
        assert np.array_equal(a[sound], b[sound])
        assert not np.isfinite(a[1]).any()


def test_a_body_solves_alike_on_either_path(monkeypatch):
    """u of a pulled block to 1e-12 of its largest, by FFCx's own C and in lanes."""
    found = []
    for plain in (False, True):
        with monkeypatch.context() as patch:
            if plain:
                patch.setattr(terms, "compiled", lambda unit: library(unit.name, plain=True))
            body = supple.Body(supple.Mesh.box((3, 2, 2), (3.0, 1.0, 1.0), "P1"), "neo_hookean")
            body.fix(lambda x: x[:, 0] < 1e-9)
            body.traction(lambda x: x[:, 0] > 3 - 1e-9, (100.0, -40.0, 20.0))
            found.append(body.solve().u)
    np.testing.assert_allclose(found[0], found[1], atol=1e-12 * abs(found[1]).max(), rtol=0)
