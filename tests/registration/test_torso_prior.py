"""The study of a learnt prior: bodies teach, others judge."""

from __future__ import annotations

import pytest

from supple.studies.torso_cases import templates
from supple.studies.torso_prior import JUDGED, TAUGHT, rows, summary


def test_no_body_judges_that_taught_or_is_of_the_acceptance() -> None:
    """Its shapes are 0 to 99."""
    assert not set(TAUGHT) & set(JUDGED)
    assert min(*TAUGHT, *JUDGED) >= 100


@pytest.mark.slow
def test_bodies_of_the_template_teach_it_no_harm() -> None:
    """They are in its prior already: the skin stays within 1.2 mm, landmarks where they were."""
    found = list(rows("procedural", "procedural", templates(), [2001], [1000]))
    assert [row["prior"] for row in found] == 4 * ["assumed", "learnt"]
    means = summary(found)
    assert means["learnt"]["surface_mm"] < 1.2
    assert means["learnt"]["landmark_mm"] < means["assumed"]["landmark_mm"] + 1.0
