"""`supple template`: templates are made, described and drawn."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from supple.cli import main
from supple.registration.procedural import torso
from supple.registration.template_file import read_template, write_template
from supple.registration.template_picture import shown_shapes


def test_show_draws_the_template_that_ships(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["template", "show", "--out", str(tmp_path / "out")]) == 0
    picture = np.asarray(Image.open(tmp_path / "out" / "template.png").convert("L"))
    assert picture.std() > 20
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert result["vertices"] == len(torso().points)
    assert "9 bones" in capsys.readouterr().out


def test_without_a_tool_it_describes_the_template_that_ships(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["template", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["template"] == torso().name


def test_show_draws_the_template_of_a_file(tmp_path: Path) -> None:
    write_template(torso(), tmp_path / "t.glb")
    out = tmp_path / "out"
    assert main(["template", "show", str(tmp_path / "t.glb"), "--out", str(out)]) == 0
    assert (out / "template.png").stat().st_size > 10_000


def test_pairs_of_shapes_are_shown_on_both_sides() -> None:
    """A coefficient of the left has its twin of the right, so that what is shown is symmetric."""
    template = torso()
    for _, coefficients in shown_shapes(template):
        moved = np.tensordot(coefficients, template.blendshapes, axes=1)
        assert np.abs(moved[template.mirror] * [-1, 1, 1] - moved).max() < 1e-9


@pytest.mark.slow
def test_make_writes_a_template_that_is_read_again(shared: Path, tmp_path: Path) -> None:
    data, out = shared / "data", tmp_path / "out"
    arguments = ["template", "make", str(data / "template_makehuman"), "--out", str(out)]
    assert main([*arguments, "--mpfb", str(data / "template_mpfb2")]) == 0
    made = read_template(out / "torso.glb")
    assert len(made.blendshapes) >= 55
    assert len(made.points) == json.loads((out / "result.json").read_text())["vertices"]


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--out", "x", "show"], "go after show"),
        (["show", "nowhere.glb"], "no file at nowhere.glb"),
        (["make", "nowhere"], "nowhere"),
        (["make", ".", "--name", "torso.obj"], "--name"),
        (["make", ".", "--name", "../torso.glb"], "--name"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: list[str], match: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["template", *arguments]) == 2
    assert match in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
