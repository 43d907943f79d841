"""A law's table: what holds is passed, every planted fault is found and located."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.author import properties
from supple.author.inspect_law import inspect_law
from supple.author.points import PointLaw
from supple.author.samples import Range
from supple.laws import read_law

HEAD = (
    '"""A law made for this test."""\n'
    "from supple.energy import Direction, Kinematics, Pa, inner, ln, positive, tr\n\n\n"
)
PSI = "def psi(k: Kinematics, mu: Pa = 1e3, fibre: Direction = (1.0, 0.0, 0.0)):\n    return "
SOLID = "mu / 2 * (k.I1 - 3 - 2 * ln(k.J)) + mu * ln(k.J) ** 2"
FIBRES = " + mu / 10 * positive(k.I4(fibre) - 1) ** 2"


def written(folder, body, exceptions=""):
    file = folder / "mine.py"
    declared = f"exceptions = {exceptions}\n\n\n" if exceptions else ""
    file.write_text(HEAD + declared + PSI + body + "\n", encoding="utf-8")
    return file


def failed(found):
    return {p.name.split(":")[0] for p in found.failed}


@pytest.mark.parametrize("law", ["neo_hookean", "saint_venant_kirchhoff", "corotational_qr"])
def test_a_law_of_the_thesis_is_what_it_must_be(law):
    found = inspect_law(law)
    assert not found.failed
    assert found.compiled
    assert {p.declared for p in found.properties if p.declared} == found.law.exceptions


@pytest.mark.slow
@pytest.mark.parametrize("law", [m.name for m in supple.materials()])
def test_every_shipped_solid_is_what_it_must_be(law):
    if not getattr(read_law(law), "solid", True):
        pytest.skip("a skin's energy has no cube to test")
    found = inspect_law(law)
    assert not found.failed, [(p.name, p.figure, p.note) for p in found.failed]


@pytest.mark.parametrize(
    ("body", "exceptions", "fault"),
    [
        (SOLID + FIBRES, "", "isotropic"),
        (SOLID, '{"isotropic"}', "isotropic"),
        (SOLID, '{"barrier"}', "barrier"),
        ("mu * inner(k.E, k.E)", "", "barrier"),
        ("mu * inner(k.E, k.E) * 2 - mu * (k.J - 1) ** 2", '{"barrier"}', "psi ≥ 0"),
        ("mu * (k.I1 - 3 - 2 * ln(k.J)) - 2 * mu * ln(k.J) ** 2", "", "elliptic at rest"),
    ],
)
def test_a_fault_fails_its_own_line(tmp_path, body, exceptions, fault):
    """Undeclared faults, and exceptions that a law declares and does not have."""
    assert fault in failed(inspect_law(written(tmp_path, body, exceptions)))


def test_fibres_that_only_pull_pass_with_their_exception(tmp_path):
    """Their tangent jumps where I4 = 1, which is at rest; nowhere is that taken for a fault."""
    assert not failed(inspect_law(written(tmp_path, SOLID + FIBRES, '{"isotropic"}')))


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        (SOLID + " + mu", "psi(I) = 0"),
        ("mu * (k.I1 - 3)", "sigma(I) = 0"),
        (SOLID + " + mu * (tr(k.F) - 3) ** 2", "objective"),
    ],
)
def test_a_law_that_may_not_be_compiled_is_told_why(tmp_path, body, fault):
    found = inspect_law(written(tmp_path, body))
    assert failed(found) == {fault}
    assert not found.compiled
    assert not found.curves


def test_negative_energy_is_located(tmp_path):
    """ψ = -mu (J - 1)² alone is least at the largest volume change: J = 1.5 or 0.5."""
    body = "mu * inner(k.E, k.E) / 10 - mu * (k.J - 1) ** 2"
    found = inspect_law(written(tmp_path, body, '{"barrier"}'))
    (line,) = [p for p in found.properties if p.name == "psi ≥ 0"]
    assert "least at" in line.note


def test_a_wrong_derivative_is_found():
    """Stress one part in ten thousand too large, tangent as much, and not symmetric."""

    class Wrong(PointLaw):
        def stress(self, F):
            return 1.0001 * super().stress(F)

        def tangent(self, F):
            A = super().tangent(F)
            A[:, 0, 1, 2, 2] *= 1.0001
            return A

    F = Range(samples=16).deformations()
    tried = properties.derivatives(Wrong(read_law("neo_hookean")), F, 4e3, 0)
    assert not any(p.passed for p in tried)
    right = properties.derivatives(PointLaw(read_law("neo_hookean")), F, 4e3, 0)
    assert all(p.passed for p in right)


def test_parameters_and_range_are_those_asked_for(tmp_path):
    span = Range((0.7, 1.2), 0.4, (0.9, 1.1))
    found = inspect_law("neo_hookean", span, young=1e6)
    assert found.values == {"young": 1e6, "poisson": 0.3}
    for curve in found.curves:
        ends = span.values(curve.mode)
        assert (curve.values.min(), curve.values.max()) == (ends.min(), ends.max())
        assert curve.mode.rest in curve.values
    with pytest.raises(supple.MaterialError, match="did you mean young"):
        inspect_law("neo_hookean", yuong=1.0)


def test_random_deformations_are_within_the_range():
    F = Range(volume=(0.8, 1.3), samples=200).deformations()
    J = np.linalg.det(F)
    assert J.min() >= 0.8
    assert J.max() <= 1.3
    with pytest.raises(supple.InputError, match="stretch must go from below 1 to above 1"):
        Range(stretch=(1.1, 2.0))


def test_a_wrong_file_is_refused_when_it_is_named(tmp_path):
    """DESIGN §3: not stress free, at once and not at the first solve."""
    file = written(tmp_path, "mu * (k.I1 - 3)")
    with pytest.raises(supple.MaterialError, match="the stress at F = I is 2000 Pa, not 0"):
        supple.material(file)
    assert supple.material(written(tmp_path, SOLID)).name == "mine"
