"""A case file is read strictly: each error names file, table and key, and what to do."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from supple.case import Table, nearest, read_case
from supple.errors import InputError, MeshError


def case(tmp_path: Path, text: str) -> Table:
    file = tmp_path / "case.toml"
    file.write_text(text, encoding="utf-8")
    return read_case(file)


def test_values_come_back_as_written(tmp_path: Path) -> None:
    (tmp_path / "a.msh").touch()
    top = case(
        tmp_path,
        'file = "a.msh"\nyoung = 3e3\ncells = 2\nskin = true\ncentre = [1, 2.5, -3]\n'
        "[law]\nc1 = 1\nc2 = 2.5\n[[fix]]\nwhere = 1\n[[fix]]\nwhere = 2\n",
    )
    assert top.path("file") == tmp_path / "a.msh"
    assert top.number("young") == 3000.0
    assert top.number("poisson", 0.3) == 0.3
    assert top.integer("cells") == 2
    assert top.flag("skin") is True
    assert top.vector("centre") == (1.0, 2.5, -3.0)
    law = top.table("law")
    assert law is not None
    assert law.numbers({"c1": 1, "c2": 1, "bulk": 1}) == {"c1": 1.0, "c2": 2.5}
    assert [item.value("where") for item in top.tables("fix")] == [1, 2]
    assert top.table("gravity") is None
    assert top.tables("force") == []
    law.done()
    top.done()


Get = Callable[[Table], Any]


@pytest.mark.parametrize(
    ("text", "get", "message"),
    [
        ("a = 'x'", lambda t: t.number("a"), r"a must be a number, got 'x'"),
        ("a = true", lambda t: t.number("a"), r"a must be a number, got True"),
        ("a = nan", lambda t: t.number("a"), r"a must be a number, got nan"),
        ("a = inf", lambda t: t.number("a"), r"a must be a number, got inf"),
        ("a = 1" + "0" * 400, lambda t: t.number("a"), r"a must be a number, got 1000"),
        ("a = 0", lambda t: t.number("a", above=0), r"a must be a number above 0, got 0"),
        (
            "a = 0.5",
            lambda t: t.number("a", above=-1, below=0.5),
            r"a must be a number above -1 and below 0.5, got 0.5",
        ),
        ("a = 1.5", lambda t: t.integer("a"), r"a must be a whole number of at least 0, got 1.5"),
        ("a = true", lambda t: t.integer("a"), r"a must be a whole number"),
        ("a = 0", lambda t: t.flag("a"), r"a must be true or false, got 0"),
        ("a = 1", lambda t: t.text("a"), r"a must be a text in quotes, got 1"),
        ("a = ''", lambda t: t.text("a"), r"a must be a text in quotes, got ''"),
        ("a = 'P3'", lambda t: t.text("a", choices=("P1", "P2")), r'a must be one of "P1", "P2"'),
        ("a = [1, 2]", lambda t: t.vector("a"), r"a must be a list of 3 numbers, got \[1, 2\]"),
        ("a = [1, 2, nan]", lambda t: t.vector("a"), r"a must be a list of 3 numbers"),
        ("a = 'b.msh'", lambda t: t.path("a"), r"a: .*b\.msh does not exist"),
        ("a = 1", lambda t: t.table("a"), r"a must be a table, written \[a\], got 1"),
        ("a = 1", lambda t: t.tables("a"), r"a must be a list of tables, each written \[\[a\]\]"),
        ("[a]", lambda t: t.tables("a"), r"a must be a list of tables, each written \[\[a\]\]"),
        ("", lambda t: t.number("young"), r"young is missing; add it"),
        ("yuong = 1", lambda t: t.number("young"), r'young is missing, there is "yuong"'),
        ("", lambda t: t.required("mesh"), r"mesh is missing; add it"),
    ],
)
def test_a_wrong_value_names_its_key_what_is_expected_and_what_is_there(
    tmp_path: Path, text: str, get: Get, message: str
) -> None:
    with pytest.raises(InputError, match=r"case\.toml: " + message):
        get(case(tmp_path, text))


def test_an_unknown_key_is_refused_with_the_nearest_known_one(tmp_path: Path) -> None:
    top = case(tmp_path, "[material.skin]\nyoung = 1.0\nthicknes = 2e-3")
    skin = top.required("material").required("skin")
    skin.number("young")
    skin.number("thickness", 1e-3)
    expected = 'case.toml: [material.skin] thicknes: unknown key; did you mean "thickness"?'
    with pytest.raises(InputError, match=re.escape(expected)):
        skin.done()


def test_tables_of_one_name_are_counted_from_one(tmp_path: Path) -> None:
    second = case(tmp_path, "[[fix]]\n[[fix]]\nwhere = 1").tables("fix")[0]
    with pytest.raises(InputError, match=re.escape("case.toml: [fix 1] where is missing")):
        second.value("where")


def test_an_error_of_the_library_is_pointed_at_the_key_and_keeps_its_kind(tmp_path: Path) -> None:
    top = case(tmp_path, "")
    message = r"case\.toml: mesh: Cell 3 is inverted\."
    with pytest.raises(MeshError, match=message), top.named("mesh"):
        raise MeshError("Cell 3 is inverted.")


def test_a_file_that_is_no_case_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not a file"):
        read_case(tmp_path / "absent.toml")
    with pytest.raises(InputError, match="is not a file"):
        read_case(tmp_path)
    (tmp_path / "image.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not text in UTF-8"):
        read_case(tmp_path / "image.toml")
    with pytest.raises(InputError, match=r"is not valid TOML: .*line 2"):
        case(tmp_path, "a = 1\nb 2")


def test_nearest_offers_all_where_none_is_near() -> None:
    assert nearest("yung", ["young", "poisson"]) == 'did you mean "young"?'
    assert nearest("zzz", ["young", "poisson"]) == "known are poisson, young."
    assert nearest("zzz", []) == "none is known here."
