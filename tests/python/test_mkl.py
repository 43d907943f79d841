"""MKL is an extra: what is said where it is not there, and how it is found where it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from supple import InputError, mkl


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
