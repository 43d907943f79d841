"""The hanging dome: depths that DOLFINx found for rest and supine, and round trips that close."""

from __future__ import annotations

import pytest

from supple.studies import hanging_dome

EXIST = [c for c in hanging_dome.CASES if c.rest is not None]


@pytest.mark.parametrize("case", EXIST, ids=lambda c: f"E{c.young:g}-skin{c.skin_young:g}")
def test_rest_and_supine_depths_agree_with_dolfinx_and_round_trips_close(case):
    """Depths within 2 mm of DOLFINx' (given to 1 mm); the prone shape comes back to 1e-9 m."""
    found = hanging_dome.run(case)
    assert found.rest == pytest.approx(case.rest, abs=2e-3)
    assert found.supine == pytest.approx(case.supine, abs=2e-3)
    assert found.round_trip <= 1e-9


@pytest.mark.slow
def test_a_far_too_soft_clamped_dome_has_no_rest_shape():
    """DOLFINx ended at 55 to 59 % of gravity with 0.32 kPa under a 22.7 kPa skin."""
    case = next(c for c in hanging_dome.CASES if c.rest is None)
    found = hanging_dome.run(case)
    assert found.rest is None
    assert 0.50 <= found.reached <= 0.65
