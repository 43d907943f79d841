"""The name of one kernel library: law.element.form[.q<degree>] or load.element.

    neo_hookean.P1.direct        mooney_rivlin.Q2.inverse.q6
    neo_hookean.T1.skin_direct   traction.T1

Names only: nothing of UFL is imported here.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SOLIDS = ("P1", "P2", "Q1", "Q2")
FACETS = ("T1", "T2", "S1", "S2")
LAW_FORMS = ("direct", "inverse", "skin_direct", "skin_inverse")
VOLUME_LOADS = ("body_force", "body_force_rest")
FACET_LOADS = ("traction", "traction_moved", "pressure", "pressure_moved")
#: Exact loads of a chosen field, from a law; for studies, so never compiled ahead.
MANUFACTURED = ("manufactured_force", "manufactured_traction")


@dataclass(frozen=True)
class Unit:
    """One kernel library.

    Attributes:
        form: one of LAW_FORMS, VOLUME_LOADS, FACET_LOADS or MANUFACTURED.
        element: name of the cell or facet element.
        law: energy file, None for a load.
        degree: quadrature degree, None for the pinned default.
    """

    form: str
    element: str
    law: Path | None = None
    degree: int | None = None

    @property
    def name(self) -> str:
        if self.law is None:
            return f"{self.form}.{self.element}"
        suffix = "" if self.degree is None else f".q{self.degree}"
        return f"{self.law.stem}.{self.element}.{self.form}{suffix}"


def loads() -> list[Unit]:
    """Every load on every element: none depends on a law."""
    on_cells = [Unit(form, e) for form in VOLUME_LOADS for e in SOLIDS]
    return on_cells + [Unit(form, e) for form in FACET_LOADS for e in FACETS]


def parse(name: str, materials: Path) -> Unit:
    """The unit of a name; a law is looked up in the folder ``materials``.

    Raises:
        ValueError: no such form or element.
    """
    parts = name.split(".")
    if len(parts) == 2 and parts[0] in VOLUME_LOADS + FACET_LOADS:
        return Unit(parts[0], parts[1])
    if len(parts) not in (3, 4) or parts[2] not in LAW_FORMS or parts[1] not in SOLIDS + FACETS:
        raise ValueError(f"unit: expected law.element.form or load.element, got {name!r}.")
    degree = int(parts[3].removeprefix("q")) if len(parts) == 4 else None
    return Unit(parts[2], parts[1], materials / f"{parts[0]}.py", degree)
