"""Supple: strain energies in one line, fast finite elements, and where a tumour lies supine.

Names are loaded at first use, so ``import supple`` is quick and works before anything is compiled.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from .errors import ConvergenceError, InputError, MaterialError, MeshError, SuppleError

if TYPE_CHECKING:
    from .assembly import assemble as assemble
    from .author.curves import curves as curves
    from .author.fit import fit as fit
    from .body import Body as Body
    from .laws import Material as Material
    from .laws import material as material
    from .laws import materials as materials
    from .mesh import Mesh as Mesh
    from .mesh import Tag as Tag
    from .overlap import overlapping as overlapping
    from .prestress import Prestress as Prestress
    from .rest_check import RoundTrip as RoundTrip
    from .rest_check import reversed_gravity_error as reversed_gravity_error
    from .rest_check import round_trip as round_trip
    from .state import Rest as Rest
    from .state import State as State
    from .surface import Surface as Surface

__version__ = "0.1.0"

_HOME = {
    "Body": "body",
    "Material": "laws",
    "Mesh": "mesh",
    "Prestress": "prestress",
    "Rest": "state",
    "RoundTrip": "rest_check",
    "State": "state",
    "Surface": "surface",
    "Tag": "mesh",
    "assemble": "assembly",
    "curves": "author.curves",
    "fit": "author.fit",
    "material": "laws",
    "materials": "laws",
    "overlapping": "overlap",
    "reversed_gravity_error": "rest_check",
    "round_trip": "rest_check",
    "sensitivity": "sensitivities",
}

__all__ = [
    "ConvergenceError",
    "InputError",
    "MaterialError",
    "MeshError",
    "SuppleError",
    *_HOME,
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'supple' has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
