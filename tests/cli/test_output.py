"""The output folder is there complete or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from supple.cli._output import OutputFolder
from supple.errors import InputError


def everything(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def test_nothing_appears_under_the_target_before_it_is_published(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "out")
    folder.path("a.txt").write_text("a")
    assert not (tmp_path / "out").exists()
    assert folder.publish() == ["a.txt"]
    assert everything(tmp_path) == ["out", "out/a.txt"]


def test_a_discarded_folder_leaves_nothing_behind(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "deep" / "out")
    folder.path("parts/a.txt").write_text("a")
    folder.discard()
    assert everything(tmp_path) == []


def test_an_unused_folder_is_never_made(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "out")
    assert folder.publish() == []
    assert everything(tmp_path) == []


def test_missing_parents_are_made_when_published(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path / "deep" / "out")
    folder.path("parts/a.txt").write_text("a")
    folder.publish()
    assert everything(tmp_path) == ["deep", "deep/out", "deep/out/parts", "deep/out/parts/a.txt"]


def test_an_existing_folder_keeps_its_other_files(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "a.txt").write_text("old")
    folder = OutputFolder(tmp_path)
    folder.path("a.txt").write_text("new")
    folder.path("parts/b.txt").write_text("b")
    folder.publish()
    assert (tmp_path / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "new"
    assert everything(tmp_path) == ["a.txt", "notes.txt", "parts", "parts/b.txt"]


def test_a_new_folder_has_the_rights_that_mkdir_would_give(tmp_path: Path) -> None:
    (tmp_path / "usual").mkdir()
    folder = OutputFolder(tmp_path / "out")
    folder.path("a.txt").write_text("a")
    folder.publish()
    assert (tmp_path / "out").stat().st_mode == (tmp_path / "usual").stat().st_mode


@pytest.mark.parametrize("target", ["taken", "taken/below"])
def test_a_file_in_the_way_is_refused_at_once(tmp_path: Path, target: str) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(InputError, match=r"--out must name a folder, but .*taken is a file"):
        OutputFolder(tmp_path / target)


def test_a_place_where_nothing_can_be_made_is_refused_at_once() -> None:
    """Root may write anywhere by its rights; the kernel's own folders take no files even so."""
    with pytest.raises(InputError, match=r"--out .* cannot be written"):
        OutputFolder(Path("/proc/supple"))
