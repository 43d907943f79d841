"""The name of one kernel library: law.element.form[.q<degree>[-<scheme>]] or load.element.

    neo_hookean.P1.direct        mooney_rivlin.Q2.inverse.q6
    neo_hookean.T1.skin_direct   mooney_rivlin.P2.direct.q4-xiao_gimbutas
    traction.T1                  mooney_rivlin.P2.mixed_direct
    body_force.P1                neo_hookean.P1.direct_sensitivity

Names only: nothing of UFL is imported here.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from . import cells
from . import degree as degrees

SOLIDS = tuple(cells.ELEMENTS)
FACETS = tuple(cells.FACETS)
FORMULATIONS = {"displacement": "", "mixed": "mixed_", "mean-dilatation": "mean_dilatation_"}
#: Elements on which a formulation is offered.
OFFERED = {"displacement": SOLIDS, "mixed": ("P2", "Q2L"), "mean-dilatation": ("Q1",)}
#: Ends the name of the form whose sensitivities a unit holds.
SENSITIVITY = "_sensitivity"
LAW_FORMS = tuple(
    f"{formulation}{way}"
    for formulation in (*FORMULATIONS.values(), "skin_")
    for way in ("direct", "inverse")
)
#: Forms without a law on cells: loads, and the mass matrix that projections need.
VOLUME_LOADS = ("body_force", "body_force_rest", "mass")
FACET_LOADS = ("traction", "traction_moved", "pressure", "pressure_moved")
#: Exact loads of a chosen field, from a law; for studies, so never compiled ahead.
MANUFACTURED = ("manufactured_force", "manufactured_traction")


@dataclass(frozen=True)
class Unit:
    """One kernel library.

    Attributes:
        form: one of LAW_FORMS, VOLUME_LOADS, FACET_LOADS or MANUFACTURED; of the first three also
            with SENSITIVITY behind it.
        element: name of the cell or facet element.
        law: energy file, None for a load.
        degree: of the quadrature, maybe with a scheme (`degree.Degree`); None for the pinned rule.
        plain: FFCx's own C, one cell a call: the reference of the kernels in lanes.
    """

    form: str
    element: str
    law: Path | None = None
    degree: int | None = None
    plain: bool = False

    @property
    def name(self) -> str:
        if self.law is None:
            return f"{self.form}.{self.element}"
        suffix = "" if self.degree is None else f".{degrees.named(self.degree)}"
        return f"{self.law.stem}.{self.element}.{self.form}{suffix}"


def loads() -> list[Unit]:
    """Every load on every element: none depends on a law."""
    on_cells = [Unit(form, e) for form in VOLUME_LOADS for e in SOLIDS]
    return on_cells + [Unit(form, e) for form in FACET_LOADS for e in FACETS]


def parse(name: str, materials: Path) -> Unit:
    """The unit of a name; a law is looked up in the folder ``materials``.

    Raises:
        ValueError: no such form, element or quadrature.
    """
    parts = name.split(".")
    base = parts[0 if len(parts) == 2 else min(2, len(parts) - 1)].removesuffix(SENSITIVITY)
    if len(parts) == 2 and base in VOLUME_LOADS + FACET_LOADS:
        return Unit(parts[0], parts[1])
    if len(parts) not in (3, 4) or base not in LAW_FORMS or parts[1] not in SOLIDS + FACETS:
        raise ValueError(f"unit: expected law.element.form or load.element, got {name!r}.")
    degree = degrees.parse(parts[3]) if len(parts) == 4 else None
    return Unit(parts[2], parts[1], materials / f"{parts[0]}.py", degree)
