"""One offline HTML file for the surgeon: the drawing on the scan, how sure it is, and measures.

1. words       report_words: verdict, cards, tables, all text escaped
2. scene       report_scene: scan, registered skin, drawing, packed, drawn by plotly.js in the page
3. page        templates/register.{html,js}, filled and written aside (supple.page)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from supple.page import write_page

if TYPE_CHECKING:
    from supple.registration.measures import Measures
    from supple.registration.metrics import Metrics
    from supple.registration.registration import Registration
    from supple.registration.transfer import Carried
    from supple.surface import Surface

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReportData:
    """What the page shows; m, in the scan's frame (LPS)."""

    registration: Registration
    scan: Surface
    curves: Mapping[str, Carried]
    landmarks: Mapping[str, Carried]  #: one point each
    measures: Measures
    metrics: Metrics
    title: str = ""  #: the scan, as the user named it
    said: Sequence[str] = ()  #: what was found or mended on reading
    given: Sequence[str] = ()  #: landmarks that the user gave
    versions: Mapping[str, str] = field(default_factory=dict)


def body_frame(registration: Registration) -> Floats:
    """Rows (3, 3): unit vectors to the patient's left, to her front and up, by the chest bone."""
    chest = [bone.name for bone in registration.template.bones].index("chest")
    turn = registration.posture.rotations[chest]
    return np.stack([turn[:, 0], -turn[:, 1], turn[:, 2]])


def write_report(path: str | Path, data: ReportData) -> Path:
    """Write the report as one HTML file that needs no network."""
    from supple.registration.report_scene import scene
    from supple.registration.report_words import words

    return write_page(path, "supple.registration", "register", words(data) | scene(data))
