"""Everything that `supple materials check` tells of a law.

    file ─► on numbers: ψ(I), σ(I), objective ─► compiled: isotropy, P, A, ellipticity, ψ ≥ 0

A file that fails on numbers is not compiled.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import parameters
from ..errors import MaterialError
from ..laws import read_law
from . import limits, properties
from .curves import Curve, along
from .ellipticity import least_wave_stiffness
from .limits import Limit
from .modes import MODES
from .points import PointLaw
from .properties import Property
from .samples import Range

if TYPE_CHECKING:
    from ..kernels.law import Law

_ROUND = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


@dataclass(frozen=True)
class Inspection:
    """What was found.

    Attributes:
        law: the energy.
        values: its parameters, SI.
        stiffness: largest entry of ∂²ψ/∂F² at rest, Pa: the scale of the figures.
        properties: the table.
        curves: the tests; of an anisotropic law along x, y and z.
        losses: where strong ellipticity is lost first.
        compiled: False where the file is so wrong that it cannot be compiled.
    """

    law: Law
    values: dict[str, Any]
    stiffness: float
    properties: list[Property]
    curves: list[Curve] = field(default_factory=list)
    losses: list[Limit] = field(default_factory=list)
    compiled: bool = True

    @property
    def failed(self) -> list[Property]:
        """The properties that do not hold."""
        return [p for p in self.properties if p.passed is False]


def inspect_law(material: str | Path, span: Range | None = None, **values: Any) -> Inspection:
    """Try a law on many deformations.

    Args:
        material: name of a shipped energy, or path of an energy file.
        span: how far it is deformed.
        **values: its parameters in SI, one number (or direction) each; else its defaults.

    Raises:
        MaterialError: the file cannot be read or computed, or a wrong parameter.
    """
    law, span = read_law(material), span or Range()
    known = _numbers(parameters.defaults(law, 1) | parameters.given(law, values, 1))
    scale, tried = _on_numbers(law, known, span)
    if any(p.passed is False and not p.declared for p in tried):
        return Inspection(law, known, scale, tried, compiled=False)
    point = PointLaw(law, **values)
    drawn = _curves(point, span)
    lost = [limit for c in drawn for limit in limits.losses(point, c, scale)]
    tried += _on_kernels(point, span, scale) + _along(point, drawn, lost, scale)
    tried.append(_not_negative(point, drawn, span, scale))
    return Inspection(law, known, scale, tried, drawn, lost)


def _numbers(rows: dict[str, np.ndarray[Any, np.dtype[np.float64]]]) -> dict[str, Any]:
    return {n: tuple(r[0].tolist()) if r.size > 1 else float(r[0, 0]) for n, r in rows.items()}


def _on_numbers(law: Law, values: dict[str, Any], span: Range) -> tuple[float, list[Property]]:
    """Stiffness at rest, Pa, and what must hold before a law may be compiled."""
    from ..kernels import checks
    from ..kernels.law import EnergyFileError

    try:
        scale = checks.stiffness_scale(law, values)
        if not np.isfinite(scale) or scale == 0.0:
            raise MaterialError(f"{law.path}:{law.line}: the energy has no finite stiffness at "
                                "F = I; check it and its parameters.")  # fmt: skip
        F = span.deformations()
        tried = properties.at_rest(law, values, scale)
        return scale, [*tried, properties.objective(law, values, F, scale, span.seed)]
    except EnergyFileError as problem:
        raise MaterialError(str(problem)) from None


def _on_kernels(point: PointLaw, span: Range, scale: float) -> list[Property]:
    F = span.deformations()
    return [
        properties.isotropic(point, F, scale, span.seed),
        properties.compiled_as_written(point, F, scale),
        *properties.derivatives(point, F, scale, span.seed),
        properties.barrier(point, scale),
    ]


def _curves(point: PointLaw, span: Range) -> list[Curve]:
    """All tests; a law that is not isotropic is tried along each of the three axes."""
    rounds = _ROUND if "isotropic" in point.law.exceptions else _ROUND[:1]
    return [
        along(point, mode, span.values(mode), axes)
        for mode in MODES.values()
        for axes in (rounds if mode.measured else rounds[:1])
    ]


def _along(point: PointLaw, drawn: list[Curve], lost: list[Limit], scale: float) -> list[Property]:
    """Ellipticity at rest and along the curves, and where curves end."""
    rest = float(least_wave_stiffness(point.tangent(np.eye(3)[None]))[0]) / scale
    note = "least stiffness of a plane wave over the largest of the law"
    found = [Property("elliptic at rest", bool(rest > 1e-9), rest, None, note)]
    ended = [limit for c in drawn for limit in limits.ends(point, c)]
    found.append(_information("elliptic along the curves", "loses ellipticity at", lost))
    return [*found, _information("has states along the curves", "no state beyond", ended)]


def _information(name: str, words: str, found: list[Limit]) -> Property:
    note = f"{words} {', '.join(map(str, found))}" if found else ""
    return Property(name, None, "no" if found else "yes", None, note)


def _not_negative(point: PointLaw, drawn: list[Curve], span: Range, scale: float) -> Property:
    """ψ ≥ 0 on the curves and on the random deformations."""
    psi = [(float(np.nanmin(c.energy)), c) for c in drawn if np.isfinite(c.energy).any()]
    F = span.deformations()
    random = np.nan_to_num(point.energy(F), nan=np.inf)
    least, curve = min(psi, key=lambda pair: pair[0])
    note = ""
    if random.min() < least:
        least = float(random.min())
        stretches = np.linalg.svd(F[random.argmin()], compute_uv=False)
        where = "random stretches " + ", ".join(f"{s:.3g}" for s in stretches)
    else:
        where = str(Limit(curve, float(curve.values[np.nanargmin(curve.energy)]), ""))
    if least < -1e-9 * scale:
        note = f"least at {where}"
    tried = properties.bounded("psi ≥ 0", max(0.0, -least / scale), 1e-9, note)
    return properties.excused(point.law, "stress_free", [tried])[0] if not tried.passed else tried
