"""The study of rest-shape methods: limits where they are known, table and figure of an outcome."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

import supple
from supple.studies import rest_methods as study
from supple.studies import rest_methods_figure
from supple.studies import rest_methods_report as report


def bar(stretch):
    """A bar in a stiff tube whose dead end force draws it to ``stretch`` times its rest length.

    No node moves sideways and ν = 0: neo-Hooke's P = E/2 (s - 1/s) whatever the length at rest.
    """
    mesh = supple.Mesh.box((1, 1, 2), (0.1, 0.1, 0.5), "Q1")
    body = supple.Body(mesh, "neo_hookean", young=1e3, poisson=0.0)
    body.prescribe(lambda p: p[:, 0] > -1, (0.0, 0.0, np.nan)).fix(lambda p: p[:, 2] < 1e-9)
    force = 1e3 / 2 * (stretch - 1 / stretch) * 1e-2
    return body.force(lambda p: p[:, 2] > 0.5 - 1e-9, (0.0, 0.0, force / 4))


CASE = study.Case("bar", bar, start=1.3)


@pytest.mark.slow
def test_plain_fixed_point_ends_at_twice_the_length_and_the_inverse_does_not(monkeypatch):
    """Its miss is multiplied by 1 - s; near 2 the budget ends before it has converged."""
    monkeypatch.setattr(study, "LARGEST", 3.0)
    plain = study.limit(CASE, "sellier", lambda _: None)
    assert 1.75 < plain.good < plain.bad <= 2.0
    assert plain.bad < plain.good * 1.05
    inverse = study.limit(CASE, "inverse", lambda _: None)
    assert inverse.good > 2.4
    assert inverse.bad == np.inf


def test_a_race_meets_its_tolerance(monkeypatch):
    """All racers at a stretch of 1.5, which the inverse undoes to rounding."""
    monkeypatch.setattr(study, "REPEATS", 1)
    racers = study.race(CASE, "easy", 1.5, lambda _: None)
    assert [r.method for r in racers] == list(study.RACERS)
    assert all(r.miss <= study.RACE_TOLERANCE for r in racers)
    solves = {r.method: r.solves for r in racers}
    assert solves["inverse"] == 0
    assert solves["anderson, exact from zero"] == 3  # the secant method of a linear map


@pytest.fixture
def outcome():
    limits = [study.Limit(m, 2.0, 2.1, "diverges") for m in study.METHODS]
    limits[0] = study.Limit("inverse", 3.0, 3.1, "no rest shape")
    racers = [study.Racer(m, "easy", 1.0, 0.1, 9, 20, 1e-13) for m in study.RACERS]
    racers[0] = study.Racer("inverse", "easy", 1.0, 0.01, 0, 4, 1e-15)
    racers[1] = study.Racer("sellier", "easy", 1.0, np.nan, 0, 0, np.nan)
    return study.Outcome("block", limits, racers, {"easy": 0.02})


def test_table_and_figure_hold_each_racer(outcome, tmp_path):
    rows = list(csv.DictReader(io.StringIO(report.table([outcome]))))
    assert [r["method"] for r in rows] == list(study.RACERS)
    assert rows[2]["over_inverse"] == "10"
    assert rows[1]["seconds"] == ""
    assert rows[0]["gravity_limit"] == "3"
    for suffix in ("svg", "png"):
        path = rest_methods_figure.draw([outcome], tmp_path / f"f.{suffix}")
        assert path.stat().st_size > 5000
    assert "inverse 3 g" in report.lines(outcome)[0]


def test_a_method_that_is_ahead_of_the_inverse_is_told(outcome):
    assert report.beaten(outcome) == []
    outcome.limits[3] = study.Limit("anderson", 3.5, 3.6, "diverges")
    outcome.racers[2] = study.Racer("aitken", "easy", 1.0, 0.005, 9, 20, 1e-13)
    assert len(report.beaten(outcome)) == 2
