"""Inverse shear: which cases make the study, their rates of convergence, the table."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from .inverse_shear import LAWS, Case, Outcome

ELEMENTS = ("P1", "P2", "Q1", "Q2")
#: γ of simple shear; k, 1/m, of generalised shear.
SIMPLE, GENERALISED = (0.2, 0.5, 1.0), (0.3, 1.0)
#: Meshes, cells along an edge: where the field is in the space, and where it is not.
COARSE, FINER = 2, (4, 8, 12)
#: Largest relative error where the field is in the space; largest miss of a rate elsewhere.
BAR, RATE_BAR = 1e-12, 0.1


def plan() -> list[Case]:
    """The cases, those of a series of meshes one after the other."""
    cases = []
    for law, element in product(LAWS, ELEMENTS):
        cases += [Case("simple", gamma, law, element, COARSE) for gamma in SIMPLE]
        if element in ("P2", "Q2"):
            cases += [Case("generalised", k, law, element, COARSE) for k in GENERALISED]
        else:
            cases += [Case("generalised", GENERALISED[0], law, element, n) for n in FINER]
    return cases


def series(outcomes: Sequence[Outcome]) -> list[list[Outcome]]:
    """Those whose field is in no space, by law and element, from coarse to fine."""
    found: dict[tuple[str, str], list[Outcome]] = {}
    for o in outcomes:
        if not o.case.is_in_space:
            found.setdefault((o.case.law, o.case.element), []).append(o)
    return list(found.values())


def rates(own: Sequence[Outcome]) -> tuple[float, float]:
    """Of the place and of σ between the two finest meshes; NaN where both errors are rounding.

    Theory has 2 and 1 for degree 1. The nodes are exact where σ12 is linear in γ and σ22 is none.
    """
    coarse, fine = own[-2:]
    finer = np.log(fine.case.cells / coarse.case.cells)
    exact = max(coarse.place, fine.place) < BAR
    place = np.nan if exact else np.log(coarse.place / fine.place) / finer
    return float(place), float(np.log(coarse.stress / fine.stress) / finer)


def misses(outcomes: Sequence[Outcome]) -> list[str]:
    """What is above its bar, in words; empty when all is well."""
    words = []
    for o in outcomes:
        worst = max(o.place, o.stress)
        if o.case.is_in_space and not worst <= BAR:
            words.append(f"{name(o.case)} is off by {worst:.1e}, above {BAR:g}")
    for own in series(outcomes):
        place, stress = rates(own)
        off = max(abs(stress - 1), 0.0 if np.isnan(place) else abs(place - 2))
        if not off <= RATE_BAR:
            words.append(f"{name(own[-1].case)}: rates {place:.2f} and {stress:.2f}, not 2 and 1")
    return words


def name(case: Case) -> str:
    """The case in words."""
    letter = "γ" if case.kind == "simple" else "k"
    law = case.law.replace("_", " ")
    return f"{case.kind} shear {letter} = {case.amount:g}, {law}, {case.element} 1/{case.cells}"


def csv(outcomes: Sequence[Outcome]) -> str:
    """The table; rates stand with the finest mesh of their series."""
    finest = {own[-1].case: rates(own) for own in series(outcomes)}
    lines = ["shear,amount,law,element,cells_per_edge,field_in_space,place_error,stress_error,"
             "place_rate,stress_rate,iterations"]  # fmt: skip
    for o in outcomes:
        c = o.case
        start = f"{c.kind},{c.amount:g},{c.law},{c.element},{c.cells},{str(c.is_in_space).lower()}"
        cells = ["" if np.isnan(r) else f"{r:.3f}" for r in finest.get(c, (np.nan, np.nan))]
        errors = f"{o.place:.2e},{o.stress:.2e}"
        lines.append(",".join([start, errors, *cells, str(o.iterations)]))
    return "\n".join(lines) + "\n"
