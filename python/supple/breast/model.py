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
        law: of all tissues: a shipped energy or an energy file. One whose energy is infinite at
            J = 0 is wanted: the corotational laws fold at the edge of a flattened breast.
        breast: parameters of the law in fat, and in gland and tumour where those give no others.
        gland, tumour: parameters that differ there.
        density: kg/m³ at rest, of all tissues.
        skin_law, skin: law and parameters of the skin.
        thickness: of the skin, m.
    """

    law: str = "neo_hookean"
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

    def given(self, values: Mapping[str, float]) -> Materials:
        """Copy with parameters set by full name; gland and tumour keep their ratio to the breast.

        Raises:
            InputError: no such part or parameter.
        """
        changed = self
        for name, value in values.items():
            part, _, key = name.partition(".")
            changed = changed._times(part, {key}, value / self.of(name))
        return changed

    def stiffer(self, factor: float) -> Materials:
        """Copy with all moduli of all tissues, not of the skin, multiplied by ``factor``."""
        moduli = {p.name for p in supple.material(self.law).parameters if p.unit == "Pa"}
        return self._times("breast", moduli, factor)

    def described(self) -> str:
        """The breast's parameters in words."""
        units = {p.name: p.unit for p in supple.material(self.law).parameters}
        values = [f"{k} {v:.4g} {units.get(k, '')}" for k, v in self.breast.items()]
        values = [text.removesuffix(" 1").rstrip() for text in values]
        return f"a breast of {self.law} with {', '.join(values)}"

    def _times(self, part: str, keys: set[str], factor: float) -> Materials:
        parts = ("breast", "gland", "tumour") if part == "breast" else (part,)
        changed: dict[str, Any] = {}
        for name in parts:
            old: Mapping[str, float] = getattr(self, name)
            changed[name] = {k: v * factor if k in keys else v for k, v in old.items()}
        return replace(self, **changed)


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
