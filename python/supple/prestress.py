"""What a body in equilibrium carries in itself: F, J and σ on its loaded shape.

A later simulation that starts from the loaded shape starts from these: another code reads them from
the file, Supple goes on from the rest shape, ``body.on(rest.mesh)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from .state import Equilibrium, Rest

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Prestress:
    """Fields of the loaded shape; … is the cells (c,), points (c, q) or nodes (n,) asked for.

    Attributes:
        F: (…, 3, 3) deformation gradient from rest to loaded.
        J: (…,) its determinant, so density under load is that at rest over J.
        cauchy: (…, 3, 3) stress on the loaded shape, Pa, in balance with loads and reactions.
        places: (q, 3) of the points in the reference cell (Basix' unit cell), at="quadrature" only.
    """

    F: Floats
    J: Floats
    cauchy: Floats
    places: Floats | None = None


def prestress(found: Equilibrium, at: str) -> Prestress:
    """What `Equilibrium.prestress` returns."""
    places = found._values.places if at == "quadrature" else None
    return Prestress(
        found.deformation_gradient(at), found.volume_ratio(at), found.cauchy(at), places
    )


def write_loaded(rest: Rest, path: str | Path) -> Path:
    """What `Rest.write_loaded` does."""
    carried = prestress(rest, "cells")
    nodes = {"displacement to rest [m]": rest.u}
    if rest.pressure is not None:
        nodes["pressure [Pa]"] = rest.pressure
    cells = {
        "F [1]": carried.F,
        "J [1]": carried.J,
        "Cauchy stress [Pa]": carried.cauchy,
        "von Mises stress [Pa]": rest.von_mises(),
    }
    return rest.loaded.write(path, nodes, cells)
