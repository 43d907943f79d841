"""What a prediction found → its checks, result, shapes and report."""

from __future__ import annotations

import platform
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np
import SimpleITK as sitk

import supple
from supple.breast.breast_case import DIAMETER, Case
from supple.breast.facets import boundary_facets
from supple.breast.fidelity import fidelity
from supple.breast.report import ReportData, write_report
from supple.breast.result import (
    NIPPLE_ESTIMATED,
    Check,
    MeshFigures,
    Parameter,
    Result,
    SkinPoint,
    Tumour,
    breast_side,
    closest_on_skin,
    estimate_nipple,
)
from supple.breast.skin_misfit import mean_absolute
from supple.breast.tissues import Tissue

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from supple.breast.identify import Identified
    from supple.breast.image import Prone
    from supple.breast.model import Materials
    from supple.breast.poses import Poses
    from supple.breast.predict import Anatomy, Clock, Place, Registered
    from supple.breast.tetra import BreastMesh

#: Limits of the checks: relative volume, shares of the surface, mm.
VOLUME, WITHIN_ONE, ROUND_TRIP, SKIN = 0.03, 0.95, 1e-3, 5.0


@dataclass(frozen=True)
class Outcome:
    """All that the stages of a prediction found."""

    case: Case
    image: Prone
    anatomy: Anatomy
    mesh: BreastMesh
    materials: Materials
    poses: Poses
    registered: Registered | None
    identified: Identified | None

    @property
    def skin_mae_mm(self) -> float | None:
        """Mean distance scan → supine skin, mm; None without a scan."""
        if self.registered is None:
            return None
        return 1e3 * mean_absolute(self.registered.misfit.signed(self.poses.points["supine"]))


def check(o: Outcome) -> dict[str, Check]:
    """Name → passed and figure: relative errors, shares, mm."""
    f = fidelity(o.mesh, o.anatomy.labels, o.case.tumour_mm)
    least = o.poses.least_volume_ratio()
    trip = o.poses.round_trip_mm()
    volume = float(f["segmented_error"])
    checks = {
        "cells_positive": Check(bool(f["positive"] == 1.0), float(f["positive"])),
        "mesh_volume_within_3_percent": Check(abs(volume) <= VOLUME, volume),
        "surface_95_percent_within_one_voxel": Check(
            bool(f["within_one_voxel"] >= WITHIN_ONE), float(f["within_one_voxel"])
        ),
        "surface_within_two_voxels": Check(
            bool(f["within_two_voxels"] == 1.0), float(f["within_two_voxels"])
        ),
        "volume_ratio_positive": Check(least > 0.0, least),
        "round_trip_mm": Check(trip <= ROUND_TRIP, trip),
    }
    mae = o.skin_mae_mm
    if o.registered is not None and mae is not None:
        alignment = o.registered.alignment
        checks["scan_alignment_rms_mm"] = Check(alignment.trustworthy, alignment.rms_mm)
        checks["skin_mae_mm"] = Check(mae <= SKIN, mae)
    return checks


def write(o: Outcome, checks: dict[str, Check], place: Place, clock: Clock) -> Result:
    """Write shapes and report; the result, whose seconds count the writing too, is the caller's."""
    with clock("write"):
        tissue = {"tissue": o.mesh.tissue.astype(np.int64)}
        o.poses.body.mesh.write(place("prone.vtu"), cell_data=tissue)
        o.poses.rest.write(place("rest.vtu"), cell_data=tissue)
        o.poses.supine.write(place("supine.vtu"), cell_data=tissue)
        _skin(o.mesh, o.poses.points["supine"]).write(place("supine_skin.ply"))
        sitk.WriteImage(o.anatomy.labels, str(place("labels.mha")), useCompression=True)
        result, nipple = _result(o, checks)
    seconds = {**clock.seconds, "total": sum(clock.seconds.values())}
    result = replace(result, seconds=seconds)
    write_report(place("report.html"), _report(o, result, nipple))
    return result


def _result(o: Outcome, checks: dict[str, Check]) -> tuple[Result, dict[str, NDArray[np.float64]]]:
    points = o.poses.points
    nipple, estimated = _nipple(o)
    nipples = {pose: nipple.on(p, o.mesh.skin) for pose, p in points.items()}
    carried = o.poses.carry(1e-3 * np.array(o.case.tumour_mm))
    tumour = Tumour.locate(
        carried["prone"], carried["supine"], nipples["supine"], (points["supine"], o.mesh.skin),
        _midline(o),
    )  # fmt: skip
    quality = o.mesh.quality
    figures = MeshFigures(
        len(o.mesh.points), len(o.mesh.cells), float(quality["min_mean_ratio"]),
        float(quality["volume_ml"]),
    )  # fmt: skip
    result = Result(
        tumour=tumour,
        parameters=_parameters(o),
        mesh=figures,
        seconds={},
        checks=checks,
        versions=_versions(),
        warnings=_warnings(o, estimated),
        skin_mae_mm=o.skin_mae_mm,
    )
    return result, nipples


def _nipple(o: Outcome) -> tuple[SkinPoint, bool]:
    """The nipple of the breast with the tumour on the prone skin, and whether it is an estimate."""
    points, skin = o.poses.points["prone"], o.mesh.skin
    given: ArrayLike | None = o.case.nipple_mm
    if given is None and o.anatomy.nipples_mm is not None:
        right, left = o.anatomy.nipples_mm
        given = left if breast_side(o.case.tumour_mm, 1e3 * _midline(o)) == "left" else right
    if given is None:
        side = breast_side(o.case.tumour_mm, 1e3 * _midline(o))
        return estimate_nipple(points, skin, side, _midline(o)), True
    return closest_on_skin(1e-3 * np.asarray(given), points, skin)[1], o.case.nipple_mm is None


def _midline(o: Outcome) -> float:
    """x, m, of the sagittal plane between the breasts."""
    if o.anatomy.nipples_mm is not None:
        return 1e-3 * float(np.mean([point[0] for point in o.anatomy.nipples_mm]))
    x = o.mesh.points[:, 0]
    return float(0.5 * (x.min() + x.max()))


def _parameters(o: Outcome) -> dict[str, Parameter]:
    m = o.materials
    units = {p.name: p.unit for p in supple.material(m.law).parameters}
    skin_units = {p.name: p.unit for p in supple.material(m.skin_law).parameters}
    sd = o.identified.sd if o.identified else {}
    found = {
        f"{part}.{name}": Parameter(float(value), units.get(name, ""), sd.get(f"{part}.{name}"))
        for part, values in (("breast", m.breast), ("gland", m.gland), ("tumour", m.tumour))
        for name, value in values.items()
    }
    for name, value in m.skin.items():
        key = f"skin.{name}"
        found[key] = Parameter(float(value), skin_units.get(name, ""), sd.get(key))
    found["skin.thickness"] = Parameter(m.thickness, "m")
    found["breast.density"] = Parameter(m.density, "kg/m³")
    return found


def _warnings(o: Outcome, nipple_estimated: bool) -> list[str]:
    told = [*o.image.warnings, *o.anatomy.warnings, *o.mesh.warnings]
    if o.registered is not None:
        told += o.registered.alignment.warnings
    if o.identified is not None:
        if any(sd is None for sd in o.identified.sd.values()):
            told.append(f"No spread of the parameters: {o.identified.sd_reason}.")
        if o.identified.failed:
            told.append(f"{o.identified.failed} sets of parameters tried had no rest shape.")
    if nipple_estimated:
        told.append(NIPPLE_ESTIMATED)
    if o.case.tumour_diameter_mm is None:
        told.append(f"No diameter of the tumour was given: {DIAMETER:g} mm was assumed.")
    if o.registered is None:
        told.append("Without a supine scan the stiffness is an assumption, not a measurement.")
    return told


def _report(o: Outcome, result: Result, nipple: dict[str, NDArray[np.float64]]) -> ReportData:
    gland = o.mesh.cells[o.mesh.tissue == Tissue.GLAND]
    return ReportData(
        result=result,
        points=dict(o.poses.points),
        skin=o.mesh.skin,
        tumour=dict(o.poses.carry(1e-3 * np.array(o.case.tumour_mm))),
        tumour_radius=0.5e-3 * (o.case.tumour_diameter_mm or DIAMETER),
        nipple=dict(nipple),
        gland=boundary_facets(gland) if len(gland) else None,
        chest=o.mesh.chest,
        scan=None if o.registered is None else o.registered.points,
        title=o.case.title or o.case.image.name,
        assumptions=_assumptions(o),
    )


def _assumptions(o: Outcome) -> dict[str, str]:
    held = {
        "fixed": "the chest wall and the cuts where tissue goes on stay where they are",
        "sliding": "tissue slides on the rigid chest wall; the cuts stay where they are",
    }
    measured = "identified from the scan" if o.identified else "assumed"
    return {
        "poses": "prone in the image, gravity towards the front; supine, gravity towards the back",
        "law of the tissue": o.materials.law,
        "stiffness": measured,
        "skin": "a membrane that carries tension only",
        "support": held[o.case.support],
        "labels": "given" if o.case.labels else "segmented automatically",
    }


def _skin(mesh: BreastMesh, points: NDArray[np.float64]) -> supple.Surface:
    nodes, rows = np.unique(mesh.skin, return_inverse=True)
    return supple.Surface(points[nodes], rows.reshape(-1, 3))


def _versions() -> dict[str, str]:
    names = ("numpy", "scipy", "simpleitk", "mmgpy", "cma", "plotly")
    return {
        "supple": supple.__version__,
        "python": platform.python_version(),
        **{name: version(name) for name in names},
    }
