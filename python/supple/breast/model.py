"""The breast as a body: laws of its tissues, a skin that pulls, a chest wall that holds.

    mesh with tissues ─► law, a value for each cell ─► skin ─► support ─► body, no load yet

Mazier 2022, §5.4. The support is the chest wall, and the cuts where tissue goes on in the patient.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

import supple
from supple.breast.tissues import Tissue
from supple.errors import InputError
from supple.mesh_tags import Tag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from supple.breast.tetra import BreastMesh

SUPPORTS = ("fixed", "sliding")


@dataclass(frozen=True)
class Materials:
    """Laws and their parameters, SI.

    Attributes:
        law: of all tissues: a shipped energy or an energy file.
        breast: parameters of the law in fat, and in gland and tumour where those give no others.
        gland, tumour: parameters that differ there.
        density: kg/m³ at rest, of all tissues.
        skin_law, skin: law and parameters of the skin.
        thickness: of the skin, m.
    """

    law: str = "corotational_polar"
    breast: Mapping[str, float] = field(default_factory=lambda: {"young": 1e3, "poisson": 0.45})
    gland: Mapping[str, float] = field(default_factory=dict)
    tumour: Mapping[str, float] = field(default_factory=dict)
    density: float = 1e3
    skin_law: str = "neo_hookean"
    skin: Mapping[str, float] = field(default_factory=lambda: {"young": 22.72e3})
    thickness: float = 2e-3

    def of(self, name: str) -> float:
        """The value of a parameter by its full name, such as "breast.young".

        Raises:
            InputError: no such part or parameter.
        """
        part, _, key = name.partition(".")
        values = {"breast": self.breast, "skin": self.skin}.get(part, {})
        if key not in values:
            known = [f"breast.{k}" for k in self.breast] + [f"skin.{k}" for k in self.skin]
            raise InputError(f"parameters must be of {', '.join(known)}, got {name!r}: choose one.")
        return float(values[key])

    def scaled(self, **factors: float) -> Materials:
        """Copy with parameters multiplied by factors, their dots written as two underscores.

        Gland and tumour keep their ratio to the breast, so one factor makes all tissue softer.
        """
        changed = self
        for name, factor in factors.items():
            part, _, key = name.partition("__")
            changed = _times(changed, part, key, factor)
            if part == "breast":
                changed = _times(_times(changed, "gland", key, factor), "tumour", key, factor)
        return changed

    def given(self, **values: float) -> Materials:
        """Copy with parameters set to values; written as for `scaled`, ratios kept as there."""
        factors = {n: v / self.of(n.replace("__", ".")) for n, v in values.items()}
        return self.scaled(**factors)


def _times(materials: Materials, part: str, key: str, factor: float) -> Materials:
    values = dict(getattr(materials, part))
    if key in values:
        values[key] *= factor
    return replace(materials, **{part: values})


def build_body(
    mesh: BreastMesh, materials: Materials | None = None, support: str = "fixed"
) -> supple.Body:
    """The body of a breast mesh, held and without load.

    Args:
        mesh: of one pose, m.
        materials: laws and parameters; the defaults of the pipeline if None.
        support: "fixed" chest wall and cuts, or a "sliding" chest wall and fixed cuts.

    Raises:
        InputError: unknown support, a part of the breast that nothing holds.
        MaterialError: unknown law or parameter, a value out of bounds.
    """
    if support not in SUPPORTS:
        raise InputError(f"support must be one of {', '.join(SUPPORTS)}, got {support!r}.")
    m = materials or Materials()
    body = supple.Body(_tagged(mesh), m.law, density=m.density, **tissue_values(m, mesh.tissue))
    body.skin("skin", m.skin_law, thickness=m.thickness, **m.skin)
    _hold(body, mesh, support)
    return body


def set_materials(body: supple.Body, materials: Materials, tissue: NDArray[np.uint8]) -> None:
    """Other parameters of the same laws for a body that `build_body` made of these tissues (c,)."""
    body.set(**tissue_values(materials, tissue))
    body.set_skin(0, **materials.skin)


def tissue_values(materials: Materials, tissue: NDArray[np.uint8]) -> dict[str, Any]:
    """Parameter name → one value for each of the cells with `Tissue` codes ``tissue`` (c,)."""
    parts = ((Tissue.GLAND, materials.gland), (Tissue.TUMOUR, materials.tumour))
    names = {name for _, part in parts for name in part} | set(materials.breast)
    values: dict[str, Any] = {}
    for name in sorted(names):
        if name not in materials.breast:
            raise InputError(
                f"{name} is given for gland or tumour and not for the breast: give it there too."
            )
        values[name] = np.full(len(tissue), materials.breast[name])
        for code, part in parts:
            values[name][tissue == code] = part.get(name, materials.breast[name])
    return values


def _tagged(mesh: BreastMesh) -> supple.Mesh:
    facets = {"skin": mesh.skin, "chest": mesh.chest, "cut": mesh.cut}
    tags = {name: Tag("facets", ids.astype(np.int64)) for name, ids in facets.items() if len(ids)}
    for code in (Tissue.GLAND, Tissue.TUMOUR):
        if (mesh.tissue == code).any():
            tags[code.name.lower()] = Tag("cells", np.flatnonzero(mesh.tissue == code))
    return supple.Mesh(mesh.points, mesh.cells.astype(np.int64), "P1", tags)


def _hold(body: supple.Body, mesh: BreastMesh, support: str) -> None:
    if len(mesh.cut):
        body.fix(np.unique(mesh.cut))
    if support == "fixed":
        body.fix(np.unique(mesh.chest))
        return
    nodes, rows = np.unique(mesh.chest, return_inverse=True)
    wall = supple.Surface(mesh.points[nodes], rows.reshape(-1, 3))
    body.slide(nodes, wall, compliance=1e-8, per_node=True)
