"""A prone image in, the supine place of a tumour out.

1. read       image, labels, scan                                        image
2. segment    tissue of every voxel, unless labels are given             segment
3. mesh       tetrahedra of both breasts on the chest wall               tetra
4. align      the scan with the skin that stays still                    torso, rigid
5. identify   stiffness of breast and skin from the scan                 identify
6. poses      rest shape, supine shape, tumour carried along             model, poses
7. check      mesh against labels, round trip, skin against scan         predict_output
8. write      result, shapes, report                                     predict_output

Lengths are mm in files, m inside; LPS everywhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import SimpleITK as sitk

import supple
from supple.breast.breast_case import DIAMETER, Case, Point
from supple.breast.identify import Identified, identify
from supple.breast.image import read_image, read_labels
from supple.breast.model import Materials, build_body
from supple.breast.poses import Poses, softest, solve_or_advise
from supple.breast.result import Result, breast_side, closest_on_skin
from supple.breast.segment import segment
from supple.breast.skin_misfit import SkinMisfit
from supple.breast.tetra import BreastMesh, build_mesh
from supple.breast.tissues import BREAST
from supple.breast.torso import torso_skin
from supple.errors import InputError
from supple.registration.region_of_interest import brush_region
from supple.registration.rigid import Alignment, align

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Where to write the output file of that name.
Place = Callable[[str], Path]
#: Told the stage, and the share of it that is done where that is known.
Watch = Callable[[str, float | None], None]
#: How far from breast tissue a tumour's centre may lie, mm.
NEAR = 3.0
#: How far from the skin a given nipple may lie, mm.
NIPPLE = 15.0


@dataclass(frozen=True)
class Anatomy:
    """What the image shows: `Tissue` codes, estimated nipples if any, remarks."""

    labels: sitk.Image
    nipples_mm: tuple[Point, Point] | None
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Registered:
    """The scan in the image's frame, and the part of it that shows the model's skin."""

    alignment: Alignment
    points: NDArray[np.float64]  # (s, 3) m, the whole scan
    misfit: SkinMisfit


@dataclass
class Clock:
    """Seconds by stage; tells each stage to whoever watches."""

    watch: Watch
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Time the block as ``stage``."""
        self.watch(stage, None)
        begin = time.perf_counter()
        yield
        self.seconds[stage] = time.perf_counter() - begin


def predict(case: Case, place: Place, watch: Watch = lambda stage, share: None) -> Result:
    """Predict where the tumour of a case lies when the patient is supine, and write all files.

    Args:
        case: what is asked.
        place: file name → path to write it at; the caller publishes or drops the files.
        watch: told how far it is.

    Returns:
        What result.json holds; a check that failed is in it and no error.

    Raises:
        InputError: something given cannot be used; nothing was written.
        ConvergenceError: no rest or supine shape, with the cause and what would help.
    """
    from supple.breast.predict_output import Outcome, check, write

    clock = Clock(watch)
    with clock("read"):
        image, scan = read_image(case.image), _read_scan(case)
        require_inside(image.image, case.tumour_mm)
    with clock("segment"):
        anatomy = _anatomy(case, image.image)
        require_in_breast(anatomy.labels, case.tumour_mm)
        still = painted_skin(case, anatomy.labels)
    with clock("mesh"):
        mesh = build_mesh(
            anatomy.labels, edge_mm=case.edge_mm, tumour_mm=case.tumour_mm,
            tumour_diameter_mm=case.tumour_diameter_mm or DIAMETER,
        )  # fmt: skip
    require_nipple(case, mesh)
    materials = _checked(case, mesh)
    registered, identified = None, None
    if scan is not None:
        with clock("align"):
            poses = solve_or_advise(mesh, materials, case.support)
            registered = _register(scan, anatomy.labels, mesh, poses, still)
        if case.identify.parameters:
            with clock("identify"):
                identified = _identify(case, mesh, materials, registered, watch)
                materials = identified.materials
    with clock("poses"):
        poses = solve_or_advise(mesh, materials, case.support, watch)
    outcome = Outcome(case, image, anatomy, mesh, materials, poses, registered, identified)
    with clock("check"):
        checks = check(outcome)
    return write(outcome, checks, place, clock)


def require_inside(image: sitk.Image, point: Point) -> None:
    """Refuse a tumour outside of the image.

    Raises:
        InputError: with the box that the image fills.
    """
    from supple.breast.grid import corners, voxel_coordinates

    index = voxel_coordinates(image, np.array([point]))[0]
    if (index < -0.5).any() or (index > np.array(image.GetSize()) - 0.5).any():
        low, high = corners(image)
        raise InputError(
            f"the tumour must lie in the image ({_box(low, high)}), got {_written(point)}: give its"
            " centre in the image's LPS mm (a viewer in RAS shows x and y with the other sign)."
        )


def require_in_breast(labels: sitk.Image, point: Point) -> None:
    """Refuse a tumour that is not in, or within `NEAR` of, breast tissue.

    Raises:
        InputError: with what is there, and how far the breasts are.
    """
    from supple.breast.grid import corners, signed_distance, voxel_coordinates

    codes = np.isin(sitk.GetArrayViewFromImage(labels), BREAST)
    image = sitk.GetImageFromArray(codes.astype(np.uint8))
    image.CopyInformation(labels)
    index = np.rint(voxel_coordinates(labels, np.array([point]))[0]).astype(int)
    index = np.clip(index, 0, np.array(labels.GetSize()) - 1)
    away = float(signed_distance(image)[tuple(index.tolist())])
    if away > NEAR:
        low, high = corners(labels)
        raise InputError(
            f"the tumour must lie in the breast, got {_written(point)}, {away:.0f} mm from its"
            f" tissue in an image of {_box(low, high)}: give its centre in LPS mm, or better labels"
            " or seeds."
        )


def require_nipple(case: Case, mesh: BreastMesh) -> None:
    """Refuse a given nipple that is not on the skin of the breast with the tumour.

    Raises:
        InputError: how far off it is, or that it is the other breast's.
    """
    if case.nipple_mm is None:
        return
    away, _ = closest_on_skin(1e-3 * np.array(case.nipple_mm), mesh.points, mesh.skin)
    if 1e3 * away > NIPPLE:
        raise InputError(
            f"the nipple must lie on the breast's skin, got {_written(case.nipple_mm)}, "
            f"{1e3 * away:.0f} mm from it: give its place in the prone image in LPS mm."
        )
    middle = 5e2 * float(mesh.points[:, 0].min() + mesh.points[:, 0].max())
    if breast_side(case.nipple_mm, middle) != breast_side(case.tumour_mm, middle):
        raise InputError(
            f"the nipple must be of the breast with the tumour, got {_written(case.nipple_mm)} "
            "on the other side: give that breast's."
        )


def _read_scan(case: Case) -> supple.Surface | None:
    if case.scan is None:
        return None
    return supple.Surface.read(case.scan, unit=case.scan_unit, points_only=True)


def _anatomy(case: Case, image: sitk.Image) -> Anatomy:
    if case.labels is not None:
        return Anatomy(read_labels(case.labels, image), None, ())
    found = segment(image, case.seeds)
    return Anatomy(found.labels, found.nipples_mm, found.warnings)


def _checked(case: Case, mesh: BreastMesh) -> Materials:
    """The case's materials, or the softest tissue that has a rest shape if that is asked for."""
    if case.softest:
        return softest(mesh, case.materials, case.support)
    build_body(mesh, case.materials, case.support)
    return case.materials


def painted_skin(case: Case, labels: sitk.Image) -> NDArray[np.bool_] | None:
    """Which points of the torso's skin were painted as still; None where that is automatic."""
    if case.still is None:
        return None
    if case.scan is None:
        raise InputError("still is the skin by which a scan is aligned; give the scan as well.")
    return brush_region(torso_skin(labels).points, case.still)


def _register(
    scan: supple.Surface, labels: sitk.Image, mesh: BreastMesh, poses: Poses,
    still: NDArray[np.bool_] | None,
) -> Registered:  # fmt: skip
    torso = torso_skin(labels)
    alignment = align(scan.points, torso.points, torso.triangles, region=still)
    points = alignment.apply(scan.points)
    skin = np.asarray(mesh.skin, dtype=np.int64)
    misfit = SkinMisfit.overlapping(points, poses.points["supine"], skin)
    return Registered(alignment, points, misfit)


def _identify(
    case: Case, mesh: BreastMesh, materials: Materials, registered: Registered, watch: Watch
) -> Identified:
    return identify(
        mesh, materials, case.support, registered.misfit, case.identify,
        lambda share: watch("identify", share),
    )  # fmt: skip


def _written(point: Point) -> str:
    return f"({point[0]:g}, {point[1]:g}, {point[2]:g})"


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> str:
    spans = zip("xyz", low, high, strict=True)
    return ", ".join(f"{axis} {a:.0f} to {b:.0f}" for axis, a, b in spans) + " mm LPS"
