"""Tables of long studies: whole lines, any order, resumed to the same table."""

from __future__ import annotations

from pathlib import Path

import pytest

import supple
from supple.studies.journal import Journal

COLUMNS = ("number", "word")


def filled(path: Path) -> Journal:
    journal = Journal(path, COLUMNS)
    for row in ((2, "two"), (0, "zero, with a comma"), (1, "one")):
        journal.append(row)
    return journal


def test_rows_come_in_any_order_and_are_sorted_in_the_table(tmp_path: Path) -> None:
    journal = filled(tmp_path / "new" / "t.csv")
    assert journal.path.read_text(encoding="utf-8").splitlines()[1] == "2,two"
    assert journal.table() == 'number,word\n0,"zero, with a comma"\n1,one\n2,two\n'


@pytest.mark.parametrize("cut", range(1, 12))
def test_a_file_cut_off_anywhere_goes_on_with_its_whole_lines(tmp_path: Path, cut: int) -> None:
    """The lost rows again, and the table is the one without the cut."""
    whole = filled(tmp_path / "t.csv")
    content = whole.path.read_bytes()
    whole.path.write_bytes(content[:-cut])
    again = Journal(whole.path, COLUMNS, resume=True)
    assert set(again.rows) < {0, 1, 2}
    for number in {0, 1, 2} - set(again.rows):
        again.append(whole.rows[number])
    assert again.table() == whole.table()
    assert sorted(again.path.read_bytes().splitlines()) == sorted(content.splitlines())


def test_a_file_cut_off_in_its_head_begins_anew(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("numb", encoding="utf-8")
    journal = Journal(tmp_path / "t.csv", COLUMNS, resume=True)
    assert journal.rows == {}
    assert journal.table() == journal.path.read_text(encoding="utf-8") == "number,word\n"


@pytest.mark.parametrize("text", ["other,word\n", "number,word\nx,one\n", "number,word\n1\n"])
def test_another_file_is_refused_and_left_as_it_is(tmp_path: Path, text: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(supple.InputError, match="choose another --out"):
        Journal(path, COLUMNS, resume=True)
    with pytest.raises(supple.InputError, match="--resume"):
        Journal(path, COLUMNS)
    assert path.read_text(encoding="utf-8") == text
