"""From a prone image to the tumour's place in the supine patient.

read ─► segment ─► mesh ─► model ─► (align ─► identify) ─► poses ─► locate ─► write
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import supple
from supple.breast import result as results
from supple.breast.image import read_image, read_labels
from supple.breast.model import build_body
from supple.breast.poses import Material, Poses, material_point, solve_poses
from supple.breast.report import ReportData, write_report
from supple.breast.skin import Scan, aligned_scan, facets_of, skin_distance
from supple.breast.tetra import BreastMesh, build_mesh, fidelity
from supple.breast.tissues import Tissue

if TYPE_CHECKING:
    import SimpleITK as sitk

    from supple.breast.breast_case import Case
    from supple.breast.model import Materials

Progress = Callable[[str, float | None], None]


@dataclass
class Stages:
    """Times the stages and tells of them."""

    progress: Progress
    seconds: dict[str, float] = field(default_factory=dict)
    start: float = field(default_factory=time.perf_counter)

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        self.progress(name, None)
        begin = time.perf_counter()
        yield
        self.seconds[name] = round(time.perf_counter() - begin, 3)

    def total(self) -> dict[str, float]:
        """All stages and their sum with what lies between them."""
        return {**self.seconds, "total": round(time.perf_counter() - self.start, 3)}


@dataclass
class Prediction:
    """What the stages find, one after the other."""

    case: Case
    labels: sitk.Image
    mesh: BreastMesh
    materials: Materials
    tumour: Material
    nipple: results.SkinPoint
    midline_x: float
    warnings: list[str]
    parameters: dict[str, results.Parameter] = field(default_factory=dict)
    scan: Scan | None = None
    skin_mae_mm: float | None = None


def predict(case: Case, write: Callable[[str], Path], progress: Progress) -> results.Result:
    """Run all stages and write the files.

    Args:
        case: what is asked for.
        write: name of an output file → where to write it (`Run.path` of the command).
        progress: called with a stage and, where known, its fraction.

    Returns:
        The result, as it is in result.json; a check that failed is in ``checks``.

    Raises:
        InputError: input that cannot be used, before any long work where that can be seen then.
        ConvergenceError: no rest shape or no supine shape, with the cause.
    """
    stages = Stages(progress)
    found = _prepare(case, stages)
    if case.scan is not None:
        _fit(found, stages)
    with stages("poses"):
        poses = solve_poses(build_body(found.mesh, found.materials, case.support), progress)
    with stages("locate"):
        if found.scan is not None:
            found.skin_mae_mm = skin_distance(found.scan, found.mesh, poses.supine.points).mae_mm
        outcome = _result(found, poses)
    with stages("write"):
        _write(found, poses, replace(outcome, seconds=stages.total()), write)
    return replace(outcome, seconds=stages.total())


def _prepare(case: Case, stages: Stages) -> Prediction:
    """Read, segment, mesh, and find tumour and nipple in the mesh."""
    with stages("read"):
        prone = read_image(case.image)
        warnings = list(prone.warnings)
        scan = None if case.scan is None else Scan.read(case.scan, case.scan_unit)
        labels = None if case.labels is None else read_labels(case.labels, prone.image)
        _require_inside(case, prone.image)
    nipples = None
    if labels is None:
        from supple.breast.segment import segment

        with stages("segment"):
            segmentation = segment(prone.image, case.seeds or None)
            labels, nipples = segmentation.labels, segmentation.nipples_mm
            warnings += segmentation.warnings
    with stages("mesh"):
        mesh = build_mesh(
            labels, edge_mm=case.edge_mm, tumour_mm=case.tumour_mm,
            tumour_diameter_mm=case.diameter_mm,
        )  # fmt: skip
        warnings += mesh.warnings
        tumour = material_point(build_body(mesh, case.materials), np.array(case.tumour_mm) / 1e3)
        middle = float(np.median(mesh.points[np.unique(mesh.chest), 0]))
        nipple, note = _nipple(case, mesh, middle, nipples)
        warnings += note
    return Prediction(
        case, labels, mesh, case.materials, tumour, nipple, middle, warnings, scan=scan
    )


def _require_inside(case: Case, image: sitk.Image) -> None:
    """Refuse a tumour outside of the image before the long work starts."""
    index = np.array(image.TransformPhysicalPointToContinuousIndex(case.tumour_mm))
    size = np.array(image.GetSize())
    if (index < -0.5).any() or (index > size - 0.5).any():
        corners = [
            image.TransformIndexToPhysicalPoint([int(k) for k in corner])
            for corner in np.ndindex(2, 2, 2)
            for corner in [np.array(corner) * (size - 1)]
        ]
        low, high = np.min(corners, axis=0).round(), np.max(corners, axis=0).round()
        raise supple.InputError(
            f"tumour {list(case.tumour_mm)} mm lies outside of the image, which spans "
            f"{low.tolist()} to {high.tolist()} in LPS mm; give its centre in that frame."
        )


def _nipple(
    case: Case, mesh: BreastMesh, midline_x: float, found: Any
) -> tuple[results.SkinPoint, list[str]]:
    """The nipple of the breast with the tumour, as a point of the skin."""
    side = results.breast_side(np.array(case.tumour_mm) / 1e3, midline_x)
    if case.nipple_mm is not None:
        place = case.nipple_mm
        note: list[str] = []
    elif found is not None:
        place, note = found[0 if side == "right" else 1], []  # segment() said that it estimated
    else:
        estimate = results.estimate_nipple(mesh.points, mesh.skin, side, midline_x)
        return estimate, ["The nipple is estimated: the most anterior point of the breast."]
    return results.closest_on_skin(np.array(place) / 1e3, mesh.points, mesh.skin)[1], note


def _fit(found: Prediction, stages: Stages) -> None:
    """Align the scan and find the parameters that it shows."""
    from supple.breast.identify import identify

    assert found.scan is not None
    with stages("align"):
        found.scan, notes = aligned_scan(found.scan, found.labels)
        found.warnings += notes
    with stages("identify"):
        fit = identify(
            found.mesh, found.materials, found.scan, found.case.identify,
            support=found.case.support, progress=stages.progress,
        )  # fmt: skip
    found.materials = fit.materials
    found.parameters = fit.parameters
    found.warnings += fit.warnings


def _result(found: Prediction, poses: Poses) -> results.Result:
    mesh, supine = found.mesh, poses.supine.points
    tumour = results.Tumour.locate(
        found.tumour.at(poses.prone), found.tumour.at(supine),
        found.nipple.on(supine, mesh.skin), (supine, mesh.skin), found.midline_x,
    )  # fmt: skip
    return results.Result(
        tumour=tumour,
        parameters=_parameters(found),
        mesh=results.MeshFigures(
            len(mesh.points), len(mesh.cells), round(mesh.quality["min_mean_ratio"], 4),
            round(mesh.quality["volume_ml"], 2),
        ),
        seconds={},
        checks=_checks(found, poses),
        versions=_versions(),
        warnings=found.warnings,
        skin_mae_mm=found.skin_mae_mm,
    )  # fmt: skip


def _parameters(found: Prediction) -> dict[str, results.Parameter]:
    """All that the model was made with; those that were identified have their sd."""
    m = found.materials
    made = {
        f"{part}.{name}": results.Parameter(float(value), "Pa" if name != "poisson" else "1")
        for part in ("breast", "gland", "tumour", "skin")
        for name, value in getattr(m, part).items()
    }
    made["breast.density"] = results.Parameter(m.density, "kg/m³")
    made["skin.thickness"] = results.Parameter(m.thickness, "m")
    return {**made, **found.parameters}


def _checks(found: Prediction, poses: Poses) -> dict[str, results.Check]:
    good = fidelity(found.mesh, found.labels, found.case.tumour_mm)

    def check(passed: bool, figure: float) -> results.Check:
        return results.Check(bool(passed), round(float(figure), 6))

    volume, J = good["segmented_error"], poses.min_volume_ratio
    made = {
        "cells_positive": check(good["positive"] == 1.0, good["positive"]),
        "mesh_volume_within_3_percent": check(abs(volume) <= 0.03, volume),
        "surface_95_percent_within_one_voxel": check(
            good["within_one_voxel"] >= 0.95, good["within_one_voxel"]
        ),
        "surface_within_two_voxels": check(
            good["within_two_voxels"] == 1.0, good["within_two_voxels"]
        ),
        "volume_ratio_positive": check(J > 0, J),
    }
    if poses.round_trip_mm is not None:
        made["round_trip_mm"] = check(poses.round_trip_mm <= 1e-3, poses.round_trip_mm)
    if found.skin_mae_mm is not None:
        made["skin_mae_mm"] = check(found.skin_mae_mm <= 5.0, found.skin_mae_mm)
    return made


def _versions() -> dict[str, str]:
    names = ("numpy", "scipy", "simpleitk", "scikit-image", "mmgpy", "plotly")
    return {
        "supple": supple.__version__,
        "python": platform.python_version(),
        **{name: version(name) for name in names},
    }


def _write(
    found: Prediction, poses: Poses, outcome: results.Result, write: Callable[[str], Path]
) -> None:
    import SimpleITK as sitk

    mesh, body_mesh = found.mesh, poses.rest.loaded
    tissue = {"tissue": mesh.tissue.astype(np.int32)}
    body_mesh.write(write("prone.vtu"), cell_data=tissue)
    poses.rest.write(write("rest.vtu"), tissue)
    poses.supine.write(write("supine.vtu"), tissue)
    nodes, rows = np.unique(mesh.skin, return_inverse=True)
    skin = supple.Surface(poses.supine.points[nodes], rows.reshape(-1, 3))
    skin.write(write("supine_skin.ply"))
    sitk.WriteImage(found.labels, str(write("labels.mha")), useCompression=True)
    write_report(write("report.html"), _report(found, poses, outcome))


def _report(found: Prediction, poses: Poses, outcome: results.Result) -> ReportData:
    mesh, case, points = found.mesh, found.case, poses.points()
    radius = 0.5e-3 * (case.diameter_mm or 10.0)
    gland = facets_of(mesh.cells[mesh.tissue == Tissue.GLAND])
    m = found.materials
    return ReportData(
        result=outcome,
        points=points,
        skin=mesh.skin,
        tumour={pose: found.tumour.at(p) for pose, p in points.items()},
        tumour_radius=radius,
        nipple={pose: found.nipple.on(p, mesh.skin) for pose, p in points.items()},
        gland=gland if len(gland) else None,
        chest=mesh.chest,
        scan=None if found.scan is None else found.scan.points,
        title=case.image.name,
        assumptions={
            "Image": "prone, gravity towards −y (anterior), LPS",
            "Prediction": "supine, gravity towards +y (posterior), arms as in the image",
            "Tissue": f"{m.law}, one density of {m.density:g} kg/m³",
            "Skin": f"{m.skin_law}, {1e3 * m.thickness:g} mm, carries tension only",
            "Chest wall": case.support,
            "Tumour": "moves with the tissue around it"
            + ("" if case.diameter_mm else "; drawn 10 mm wide, its size was not given"),
            "Moduli": "identified from the scan" if found.parameters else "population defaults",
        },
    )
