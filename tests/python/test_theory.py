"""docs/theory.md is complete: every law, element, verification file and equation is in it, rightly.

That its Python blocks run is held by test_readme.py.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

import supple
from supple import energy
from supple.kernels import elements

ROOT = Path(__file__).resolve().parents[2]
LAWS = {m.name: m for m in supple.materials()}


@cache
def text() -> str:
    return (ROOT / "docs" / "theory.md").read_text("utf-8")


@cache
def rows() -> list[list[str]]:
    """The cells of each row of each table."""
    lines = [line for line in text().splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def row(name: str) -> list[str]:
    """The first row of that name.

    Raises:
        StopIteration: there is none; give it one in docs/theory.md.
    """
    return next(row for row in rows() if row[0] == name)


def code(cell: str) -> list[str]:
    return re.findall(r"`(\w+)`", cell)


@pytest.mark.parametrize("law", LAWS)
def test_every_law_has_its_row(law: str) -> None:
    """Parameters, declared exceptions and the year of the source are those of the file."""
    _, formula, *_, parameters, source, declared = row(f"`{law}`")
    assert formula.startswith("$")
    assert sorted(code(parameters)) == sorted(p.name for p in LAWS[law].parameters)
    assert set(code(declared)) == LAWS[law].exceptions
    years = re.findall(r"\b(?:19|20)\d\d\b", source)
    assert years
    assert all(year in LAWS[law].path.read_text("utf-8") for year in years)


def test_a_row_without_a_law_is_noticed() -> None:
    """Rows that begin with a name are laws that ship, or volumetric energies of supple.energy."""
    named = {name for cells in rows() for name in code(cells[0])[:1] if cells[0][0] == "`"}
    others = {n for n in energy.__all__ if n.endswith("_volumetric")}
    assert named - {"psi_vol"} == set(LAWS) | others


@pytest.mark.parametrize("name", elements.TABLES)
def test_elements_are_those_of_the_tables(name: str) -> None:
    """Cell, meshio's name, nodes, degree and points of the pinned rule."""
    table, degree = elements.TABLES[name], elements.STIFFNESS_DEGREE[name]
    points = len(elements.quadrature(name, degree)[1])
    expected = [name, table.cell.name, table.meshio, str(table.nodes), f"{degree}, {points}"]
    assert row(name) == expected


def test_every_verification_file_has_its_line() -> None:
    """And no line is of a file that is not there."""
    listed = {name for name, *_ in rows() if name.startswith("test_")}
    there = {path.name for path in (ROOT / "tests" / "verification").glob("test_*.py")}
    assert listed == there, "docs/theory.md, last table: one line each"


def test_equations_are_numbered_without_a_gap_and_references_lead_somewhere() -> None:
    numbers = [int(n) for n in re.findall(r"\\tag\{T(\d+)\}", text())]
    assert numbers == list(range(1, len(numbers) + 1))
    assert text().count("$$") == 2 * len(numbers), "every formula on lines of its own has a number"
    assert {int(n) for n in re.findall(r"\(T(\d+)\)", text())} <= set(numbers)
    anchors = {re.sub(r"[^\w -]", "", title).lower().replace(" ", "-")
               for title in re.findall(r"^#+ (.*)$", text(), re.MULTILINE)}  # fmt: skip
    assert set(re.findall(r"\]\(#([\w-]+)\)", text())) <= anchors


def test_files_that_the_page_names_exist() -> None:
    named = re.findall(r"\b((?:kernels|python|cpp|tests)/[\w/]+\.\w+)", text())
    assert len(named) > 20
    assert [name for name in named if not (ROOT / name).is_file()] == []


def test_formulas_have_nothing_that_markdown_takes_for_its_own() -> None:
    """GitHub reads backslashes before punctuation, and bars in tables, before it reads formulas."""
    page = re.sub(r"^```.*?^```", "", text(), flags=re.DOTALL | re.MULTILINE)
    formulas = re.findall(r"\$\$(.+?)\$\$|\$(.+?)\$", page)
    assert len(formulas) > 200
    for formula in ("".join(pair) for pair in formulas):
        assert not re.search(r"\\[^a-zA-Z ]|[*<>]|\\operatorname", formula), formula
    assert page.replace("$$", "").count("$") % 2 == 0


def test_the_readme_counts_the_laws() -> None:
    assert f"{len(LAWS)} laws ship" in (ROOT / "README.md").read_text("utf-8")
