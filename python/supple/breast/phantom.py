"""A synthetic patient as files, with the truth beside them: what `supple demo` predicts from.

Stages: draw a patient (phantom_patient, phantom_anatomy) · mesh her at rest (phantom_mesh) · solve
her prone and supine (phantom_mechanics) · place a tumour that moves far enough (phantom_tumour) ·
image her prone (phantom_raster, phantom_skin, phantom_image) · scan her supine (phantom_scan) ·
write the files (phantom_files).

The chest wall does not move between the poses in the image's frame; the scan is that frame
misaligned. The same seed and size give the same patient.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from supple.breast.phantom_files import write_case, write_image, write_ply, write_truth
from supple.breast.phantom_image import BACKING, Scene, chest_distance, draw_image, draw_labels
from supple.breast.phantom_mesh import Box, Cells, make_box
from supple.breast.phantom_patient import Patient, draw_patient
from supple.breast.phantom_raster import Grid
from supple.breast.phantom_scan import Scan, ScanSettings, make_scan
from supple.breast.phantom_skin import sample_skin, voxelise
from supple.breast.phantom_truth import describe
from supple.breast.phantom_tumour import LEAST_MOTION, Poses, Tumour, least_motion, place_tumour
from supple.errors import ConvergenceError, InputError
from supple.files import replacing


@dataclass(frozen=True)
class Size:
    """How fine the synthetic patient is.

    Attributes:
        cells: of the truth's mesh.
        spacing: of the image, xyz, m.
        scan: what the scanner sees.
    """

    cells: Cells
    spacing: tuple[float, float, float]
    scan: ScanSettings = field(default_factory=ScanSettings)


SIZES = {
    "demo": Size(Cells(4, 14, 4, 4, 14, 5, 5), (1e-3, 1e-3, 2e-3)),
    "small": Size(Cells(2, 7, 2, 2, 7, 3, 4), (2e-3, 2e-3, 3e-3), ScanSettings(each=4)),
}

#: What the image shows: level from and to, depth behind the thorax's axis, margins of air, m.
_LEVELS, _BEHIND, _AIR = (-0.110, 0.116), 0.020, 0.015
_DRAWS = 8
_NAMES = ("prone.mha", "labels.mha", "supine.ply", "case.toml", "truth.json")


@dataclass(frozen=True)
class PatientFiles:
    """Where the files of a synthetic patient are; ``truth`` is not for the prediction to see."""

    image: Path
    labels: Path
    scan: Path
    case: Path
    truth: Path


@dataclass(frozen=True)
class Solved:
    """A patient whose poses are known, thorax's frame, m; ``report`` is how the solver fared."""

    patient: Patient
    poses: Poses
    tumour: Tumour
    report: dict[str, Any]


def make_patient(
    seed: int, folder: str | Path, *, size: str = "demo", use_labels: bool = True
) -> PatientFiles:
    """Make the synthetic patient ``seed`` and write her files into ``folder``.

    Args:
        seed: decides everything random: size, shape, stiffness, tumour, noise, misalignment.
        folder: made if absent; files of these names in it are replaced, all or none.
        size: "demo" or "small" (coarser mesh and voxels).
        use_labels: whether the case names the label image or leaves it commented out.

    Returns:
        prone.mha, labels.mha, supine.ply, case.toml and truth.json.

    Raises:
        InputError: unknown size or a seed below 0.
        ConvergenceError: a pose was not solved, or no patient's tumour moves far enough.
    """
    if size not in SIZES:
        raise InputError(f"size must be one of {', '.join(SIZES)}, got {size!r}: choose one.")
    if seed < 0:
        raise InputError(f"seed must be at least 0, got {seed}: choose another.")
    drawing, noise = np.random.default_rng(seed).spawn(2)
    solved = solve_patient(drawing, SIZES[size])
    return write_patient(
        solved, SIZES[size], noise, folder, {"seed": seed, "size": size}, use_labels=use_labels
    )


def solve_patient(rng: np.random.Generator, size: Size) -> Solved:
    """Draw patients until one has a tumour that moves far enough (the first nearly always has)."""
    for _ in range(_DRAWS):
        patient = draw_patient(rng)
        solved = _solve(patient, make_box(patient.anatomy, size.cells), rng)
        if solved is not None:
            return solved
    raise ConvergenceError(
        f"none of {_DRAWS} synthetic patients has a tumour that moves {LEAST_MOTION * 1e3:.0f} mm: "
        "choose another seed."
    )


def _solve(patient: Patient, box: Box, rng: np.random.Generator) -> Solved | None:
    """Solve without a tumour, place one, solve with it; None if it does not move far enough."""
    from supple.breast.phantom_mechanics import build_truth, solve_poses

    truth = build_truth(patient, box)
    tumour = place_tumour(patient, solve_poses(truth, None), rng)
    if tumour is None:
        return None
    poses = solve_poses(truth, tumour)
    if least_motion(poses, tumour.zeta[None])[0] < LEAST_MOTION:
        return None
    return Solved(patient, poses, tumour, truth.report())


def write_patient(
    solved: Solved,
    size: Size,
    rng: np.random.Generator,
    folder: str | Path,
    origin: dict[str, Any],
    *,
    use_labels: bool = True,
) -> PatientFiles:
    """Image and scan a solved patient and write all files; ``origin`` heads truth.json."""
    patient, poses = solved.patient, solved.poses
    scene = view_prone(solved, field_of_view(poses, size))
    labels = draw_labels(scene)
    image = draw_image(scene, labels, rng)
    scan = misaligned(make_scan(poses.box, poses.supine, rng, size.scan), patient)
    corner = scene.grid.origin + patient.isocentre
    prone = poses.box.interpolate(poses.prone, solved.tumour.zeta[None])[0] + patient.isocentre
    truth = origin | describe(patient, poses, solved.tumour) | {"solver": solved.report}
    with _all_or_none(Path(folder)) as (files, aside):
        write_image(aside.image, image, corner, scene.grid.spacing)
        write_image(aside.labels, labels, corner, scene.grid.spacing)
        write_ply(aside.scan, scan.points, scan.triangles, "frame scanner: LPS, misaligned")
        write_case(aside.case, prone, 2.0 * solved.tumour.radius, use_labels)
        write_truth(aside.truth, truth)
    return files


def view_prone(solved: Solved, grid: Grid) -> Scene:
    """The prone patient in front of the scanner, in the thorax's frame."""
    box, prone = solved.poses.box, solved.poses.prone
    torso = solved.patient.anatomy.torso
    inward = -BACKING * torso.normal(np.meshgrid(*box.axes[:2], indexing="ij")[0])
    body = voxelise(grid, *box.backed(prone, inward), sample_skin(box, prone, 10))
    chest = chest_distance(grid, torso)
    return Scene(grid, solved.patient.anatomy, body, solved.tumour, chest)


def misaligned(scan: Scan, patient: Patient) -> Scan:
    """A scan of the thorax's frame in the scanner's."""
    return Scan(patient.misalignment.apply(scan.points + patient.isocentre), scan.triangles)


def field_of_view(poses: Poses, size: Size) -> Grid:
    """The image's grid: the torso's width, the front down to behind the thorax's axis."""
    skin, spacing = poses.prone[poses.box.skin], np.array(size.spacing)
    low = np.array([skin[..., 0].min() - _AIR, skin[..., 1].min() - _AIR, _LEVELS[0]])
    high = np.array([skin[..., 0].max() + _AIR, _BEHIND, _LEVELS[1]])
    x, y, z = (np.floor((high - low) / spacing)).astype(int) + 1
    return Grid(low, spacing, (int(z), int(y), int(x)))


@contextmanager
def _all_or_none(folder: Path) -> Iterator[tuple[PatientFiles, PatientFiles]]:
    """The files and where to write them aside; they take their names when all are written."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in _NAMES]
    with ExitStack() as stack:
        aside = [stack.enter_context(replacing(path)) for path in files]
        yield PatientFiles(*files), PatientFiles(*aside)
