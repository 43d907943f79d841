"""`supple predict` and `supple demo`: bad input is one sentence, exit 2, nothing written."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest
import SimpleITK as sitk

from supple.cli import main


def _refused(arguments: list[str], out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert main([*arguments, "--out", str(out)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not out.exists()
    return said.err


@pytest.fixture
def image(tmp_path: Path) -> Path:
    """A volume of a plausible size with some contrast."""
    volume = sitk.GaussianSource(sitk.sitkFloat32, [60, 60, 40], [15] * 3, [120, 120, 80], 100.0)
    volume.SetSpacing([4.0, 4.0, 4.0])
    path = tmp_path / "prone.nii"
    sitk.WriteImage(volume, str(path))
    return path


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("absent.nii", None, "absent.nii"),
        ("empty.nii", b"", "empty.nii"),
        ("text.nii.gz", gzip.compress(b"not an image", mtime=0), "text.nii.gz"),
    ],
)
def test_a_file_that_is_no_image(
    tmp_path: Path, name: str, content: bytes | None, message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    arguments = ["predict", str(path), "--tumour=1,2,3"]
    assert message in _refused(arguments, tmp_path / "out", capsys)


def test_a_truncated_image(image: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image.write_bytes(image.read_bytes()[:-5000])
    said = _refused(["predict", str(image), "--tumour=100,100,80"], tmp_path / "out", capsys)
    assert "prone.nii" in said


def test_a_tumour_outside_of_the_image(
    image: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = _refused(["predict", str(image), "--tumour=900,0,0"], tmp_path / "out", capsys)
    assert "the tumour must lie in the image" in said


def test_an_image_needs_a_tumour_and_a_point_needs_three_numbers(
    image: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "--tumour" in _refused(["predict", str(image)], tmp_path / "out", capsys)
    said = _refused(["predict", str(image), "--tumour=1,2"], tmp_path / "out", capsys)
    assert "X,Y,Z" in said


def test_errors_are_json_when_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = tmp_path / "case.toml"
    case.write_text('[image]\nfile = "none.mha"\n[tumour]\ncentre_mm = [0, 0, 0]\n')
    assert main(["predict", str(case), "--json", "--out", str(tmp_path / "out")]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["type"] == "InputError"
    assert "none.mha" in error["message"]


@pytest.mark.slow
def test_the_demo_is_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Tumour within 3 mm and a fifth of the rigid error, skin within 2 mm: exit 0."""
    assert main(["demo", "--seed", "1", "--json", "--out", str(tmp_path / "demo")]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((tmp_path / "demo" / "result.json").read_text())
    assert result["truth"]["tumour_error_mm"] <= 3.0
    assert (tmp_path / "demo" / "report.html").stat().st_size > 1e6
    assert (tmp_path / "demo" / "patient" / "truth.json").is_file()
