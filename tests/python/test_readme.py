"""What README and docs show runs.

In a page of docs/, blocks run from top to bottom in one empty folder:

    python, csv  whose first line is "# NAME.py" or "# NAME.csv": that file, written
    python       runs; its names are there in the next block
    sh           each line a command that exits with 0, or as its comment says: "# exits with 3"
    text         lines of what the block before printed: of Python's exactly, of a command's up to
                 its numbers and the folder it ran in

A page may name a data file that a reader may not have. It then runs twice: without the file, up to
what it prints, and with it, when its pictures are those beside it.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from supple.cli import main

ROOT = Path(__file__).resolve().parents[2]
#: Where a page's data file lies in the shared folder.
DATA = {"rest-shape.md": "data/liver_sofa/liver.msh"}
NAMES = sorted(path.name for path in (ROOT / "docs").glob("*.md"))
PAGES = [pytest.param(name, marks=pytest.mark.slow if name in DATA else ()) for name in NAMES]


def blocks(file: Path) -> list[tuple[str, str]]:
    """(language, text) of each fenced block."""
    return re.findall(r"^```(\w+)\n(.*?)^```", file.read_text("utf-8"), re.DOTALL | re.MULTILINE)


def readme() -> list[str]:
    return [text for language, text in blocks(ROOT / "README.md") if language == "python"]


def test_the_example_runs_as_printed(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(readme()[0], "README.md", "exec"), {})
    assert re.fullmatch(r"its tip rises by \d+\.\d mm\n", capsys.readouterr().out)


def test_the_section_on_the_rest_shape_goes_on_from_the_example(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(readme()[0] + readme()[2], "README.md", "exec"), {})
    assert capsys.readouterr().out.endswith("mm\nreached\n")
    assert (tmp_path / "loaded.vtu").is_file()


def test_the_energy_shown_is_the_one_that_ships() -> None:
    shown = readme()[1].split("\n", 1)
    shipped = (ROOT / shown[0].removeprefix("# ")).read_text("utf-8")
    assert shipped.endswith("\n" + shown[1])


class Reader:
    """Does what a page says, block by block, and keeps what was printed last."""

    def __init__(self, capsys: pytest.CaptureFixture[str], compares: bool = True) -> None:
        self.capsys, self.names, self.printed, self.exactly = capsys, {}, "", True
        self.is_comparing = compares

    def does(self, language: str, text: str) -> None:
        named = re.match(r"# ([\w-]+\.(?:py|csv))\n", text)
        if named and language in ("python", "csv"):
            content = text[named.end() :] if language == "python" else text
            Path(named[1]).write_text(content, encoding="utf-8")
        elif language == "python":
            exec(compile(text, "page", "exec"), self.names)
            self.printed, self.exactly = self.capsys.readouterr().out, True
        elif language == "sh":
            for line in text.splitlines():
                told = re.search(r"# exits with (\d)", line)
                code = int(told[1]) if told else 0
                assert main(shlex.split(line, comments=True)[1:]) == code, line
            self.printed, self.exactly = self.capsys.readouterr().out, False
        elif language == "text" and self.is_comparing:
            self.compares(text)

    def compares(self, text: str) -> None:
        if self.exactly:
            assert text == self.printed
            return
        printed = {plain(line) for line in self.printed.splitlines()}
        for line in text.splitlines():
            assert plain(line) in printed, line


def plain(line: str) -> str:
    """A printed line without its numbers, its spacing and the folder it names."""
    line = line.replace(f"{Path.cwd()}/", "")
    return re.sub(r"\s+", " ", re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", line)).strip()


def read(page: str, reader: Reader) -> None:
    shown = blocks(ROOT / "docs" / page)
    assert shown
    for language, text in shown:
        reader.does(language, text)


@pytest.mark.parametrize("page", PAGES)
def test_every_block_of_a_page_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    read(page, Reader(capsys, compares=page not in DATA))


@pytest.mark.slow
@pytest.mark.parametrize("page", DATA)
def test_a_page_with_its_data_prints_and_draws_what_it_shows(
    page: str,
    shared: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    data = shared / DATA[page]
    (tmp_path / data.name).symlink_to(data)
    read(page, Reader(capsys))
    pictures = re.findall(r"\]\(([\w-]+\.png)\)", (ROOT / "docs" / page).read_text("utf-8"))
    assert pictures
    for name in pictures:
        (drawn,) = tmp_path.rglob(name)
        assert_alike(drawn, ROOT / "docs" / name)


def assert_alike(drawn: Path, shown: Path) -> None:
    """The same picture up to fonts and lines: one in fifty of the page's brightness."""
    assert shown.stat().st_size < 150_000
    new, old = (np.asarray(Image.open(file).convert("RGB"), dtype=float) for file in (drawn, shown))
    assert new.shape == old.shape, f"copy {drawn} to {shown}, and look at it"
    assert np.abs(new - old).mean() < 0.02 * 255, f"copy {drawn} to {shown}, and look at it"
