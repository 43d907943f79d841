"""The pipeline against a synthetic patient whose truth is known.

make her files ─► predict from the files alone ─► compare with the truth
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from supple.breast.breast_case import read_breast_case
from supple.breast.phantom import make_patient
from supple.breast.predict import Place, Watch, predict
from supple.breast.result import Result, Truth

#: What a demo must reach: mm, share of the rigid error, mm.
TUMOUR, SHARE, SKIN = 3.0, 0.2, 2.0


def demo(seed: int, place: Place, watch: Watch = lambda stage, share: None) -> Result:
    """Make the synthetic patient ``seed``, predict her tumour and add the errors to the result.

    Her files lie in the folder "patient" of the output.
    """
    watch("patient", None)
    files = make_patient(seed, place("patient/case.toml").parent)
    result = predict(read_breast_case(files.case), place, watch)
    return replace(result, truth=compare(result, files.truth))


def compare(result: Result, truth: Path) -> Truth:
    """The errors of a result, and of the best rigid motion, against truth.json."""
    tumour = json.loads(truth.read_text(encoding="utf-8"))["tumour"]
    error = np.linalg.norm(np.subtract(result.tumour.supine_mm, tumour["supine_mm"]))
    return Truth(float(error), float(tumour["moved_after_best_rigid_mm"]))


def shortfalls(result: Result) -> list[str]:
    """Where a demo's result misses what it must reach; empty if nowhere."""
    assert result.truth is not None
    error, rigid = result.truth.tumour_error_mm, result.truth.rigid_error_mm
    skin = np.inf if result.skin_mae_mm is None else result.skin_mae_mm
    found = []
    if error > TUMOUR:
        found.append(f"the tumour is {error:.1f} mm off, {TUMOUR:g} mm are allowed")
    if error > SHARE * rigid:
        found.append(
            f"the tumour is {error:.1f} mm off, more than a fifth of rigid alignment's {rigid:.1f}"
        )
    if skin > SKIN:
        found.append(f"the skin is {skin:.1f} mm off on average, {SKIN:g} mm are allowed")
    return found
