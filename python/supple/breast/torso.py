"""The skin of the whole torso front in a label image: what a surface scan is aligned with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from supple.breast.tissues import Tissue

if TYPE_CHECKING:
    import SimpleITK as sitk

    import supple

#: Spacing of the voxels that the surface is drawn from, mm.
SPACING = 3.0


def torso_skin(labels: sitk.Image) -> supple.Surface:
    """The surface between air and everything else, m, LPS; open at the image's borders.

    Args:
        labels: image of `Tissue` codes, LPS mm, any direction cosines.

    Source: marching cubes (Lewiner et al. 2003) on the smoothed share of body in each voxel.
    """
    import SimpleITK as sitk
    from scipy import ndimage
    from skimage.measure import marching_cubes

    import supple

    extent = np.array(labels.GetSize()) * labels.GetSpacing()
    size = [max(2, int(n)) for n in extent / SPACING]
    body = sitk.Cast(labels != int(Tissue.AIR), sitk.sitkFloat32)
    coarse = sitk.Resample(
        body, size, sitk.Transform(), sitk.sitkLinear, labels.GetOrigin(), [SPACING] * 3,
        labels.GetDirection(), 0.0,
    )  # fmt: skip
    share = ndimage.gaussian_filter(sitk.GetArrayFromImage(coarse), 0.7)
    draw: Any = marching_cubes
    corners, triangles, _, _ = draw(share, 0.5, allow_degenerate=False)
    axes = np.array(labels.GetDirection()).reshape(3, 3) * SPACING
    points = corners[:, ::-1] @ axes.T + np.array(labels.GetOrigin())
    return supple.Surface(1e-3 * points, triangles.astype(np.int64))
