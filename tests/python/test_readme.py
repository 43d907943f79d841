"""What the README shows runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest


def blocks(root: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (root / "README.md").read_text("utf-8"), re.DOTALL)


def test_the_example_runs_as_printed(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(blocks(root)[0], "README.md", "exec"), {})
    assert re.fullmatch(r"its tip rises by \d+\.\d mm\n", capsys.readouterr().out)


def test_the_energy_shown_is_the_one_that_ships(root: Path) -> None:
    shown = blocks(root)[1].split("\n", 1)
    shipped = (root / shown[0].removeprefix("# ")).read_text("utf-8")
    assert shipped.endswith("\n" + shown[1])
