"""MKL is an extra: what is said where it is not there, and how it is found where it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from supple import Body, InputError, Mesh, mkl
from supple.core import core


def block() -> Body:
    """Clamped below, it sinks by its own weight."""
    body = Body(Mesh.box((3, 3, 3), (0.1, 0.1, 0.1), "Q1"), "neo_hookean", young=1e4, density=1e3)
    return body.fix(lambda p: p[:, 2] < 1e-9).gravity((0.0, 0.0, -9.81))


def test_a_missing_library_is_named_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An environment without MKL: one sentence with what is missing, where, and two ways out."""
    monkeypatch.setattr(mkl, "_folders", lambda: [tmp_path])
    with pytest.raises(InputError, match=r'libmkl_rt.*pip install .supple.mkl...*solver="auto"'):
        mkl.load()


def test_a_library_that_is_not_mkl_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file of that name that no loader can read: refused in words, not by a crash."""
    (tmp_path / "libmkl_rt.so.2").write_bytes(b"not a library")
    monkeypatch.setattr(mkl, "_folders", lambda: [tmp_path])
    with pytest.raises(InputError, match="cannot be used"):
        mkl.load()


def test_the_newest_library_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """pip's package names the library with its version: of several the last counts."""
    for version in ("2", "10", "3"):
        (tmp_path / f"libmkl_rt.so.{version}").touch()
    monkeypatch.setattr(mkl, "_folders", lambda: [tmp_path])
    assert mkl.find() == tmp_path / "libmkl_rt.so.10"


def test_solver_pardiso_without_mkl_is_refused_with_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A solve that asks for what is not installed: the extra's name, and nothing is solved."""
    if core().pardiso_loaded():
        pytest.skip("MKL was loaded before, and stays")
    monkeypatch.setattr(mkl, "_folders", lambda: [tmp_path])
    with pytest.raises(InputError, match=r"pip install .supple\[mkl\]"):
        block().solve(solver="pardiso")


def test_pardiso_finds_what_our_factors_find() -> None:
    """A block under its weight, and one under a pressure that follows (unsymmetric): to 1e-10."""
    if mkl.find() is None:
        pytest.skip("extra mkl")
    for body in (block(), block().pressure(lambda p: p[:, 2] > 0.1 - 1e-9, 20.0)):
        state, other = body.solve(solver="pardiso"), body.solve(solver="direct")
        assert str(state.timings["solver"]).startswith("pardiso")
        assert state.timings["factorisations"] > 0
        assert abs(state.u - other.u).max() <= 1e-10 * abs(other.u).max()
