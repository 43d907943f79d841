"""`supple materials` and its tools, from an author's first file to fitted parameters."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple
from supple.cli import main

HEAD = '"""Mine. Me (2026)."""\nfrom supple.energy import Kinematics, Pa, ln, tr\n\n\n'
PSI = "def psi(k: Kinematics, mu: Pa = 1e3):\n    return "
SOLID = "mu / 2 * (k.I1 - 3 - 2 * ln(k.J)) + mu * ln(k.J) ** 2"


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An energy file in a folder of its own, which is where the command runs."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "mine.py"
    file.write_text(HEAD + PSI + SOLID + "\n", encoding="utf-8")
    return file


@pytest.fixture
def rubber(mine: Path) -> Path:
    """Three tests of a Mooney solid, c1 = 300 Pa and c2 = 60 Pa, incompressible, in kPa."""
    rows = ["mode,stretch,nominal_stress_kPa"]
    for mode, power, last in (("uniaxial", 2, -1), ("equibiaxial", 5, 2), ("planar", 3, 0)):
        for x in (1.1, 1.3, 1.6, 2.0):
            rows.append(f"{mode},{x},{2e-3 * (x - x**-power) * (300 + 60 * x**last)!r}")
    file = mine.parent / "rubber.csv"
    file.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return file


def shown(capsys: pytest.CaptureFixture[str]) -> Any:
    return json.loads(capsys.readouterr().out)


def png_size(file: Path) -> tuple[int, int]:
    head = file.read_bytes()[:24]
    assert head.startswith(b"\x89PNG")
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def test_materials_lists_every_energy_file(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["materials", "--json"]) == 0
    listed = shown(capsys)["materials"]
    shipped = sorted(file.stem for file in (root / "materials").glob("*.py"))
    assert [material["name"] for material in listed] == shipped
    assert main(["materials"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == shipped
    assert re.search(r"^neo_hookean +Compressible neo-Hookean", "\n".join(lines), re.MULTILINE)


@pytest.mark.parametrize("words", [["show", "mine.py"], ["mine.py"]])
def test_show_prints_the_energy_as_written(
    mine: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    """Nothing is compiled and nothing is written."""
    assert main(["materials", *words]) == 0
    said = capsys.readouterr().out
    assert said.startswith("mine: Mine. Me (2026).\n")
    assert "    def psi(k: Kinematics, mu: Pa = 1e3):\n        return " + SOLID in said
    assert "    mu = 1000 Pa, above 0\n" in said
    assert list(mine.parent.iterdir()) == [mine]


def test_show_names_bounds_and_exceptions(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["materials", "corotational_qr"]) == 0
    said = capsys.readouterr().out
    assert "poisson = 0.3, between -1 and 0.5" in said
    assert "declared exceptions: barrier, isotropic" in said
    assert main(["materials", "show", "mooney_rivlin", "--json"]) == 0
    as_object = shown(capsys)
    assert as_object["psi"].startswith("def psi_dev(k: Kinematics")
    assert [p["minimum"] for p in as_object["parameters"]] == [0.0, 0.0, 0.0]


def test_a_template_is_an_energy_that_passes(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is written once, never over a file, and checked without a change."""
    assert main(["materials", "new", "my_law.py"]) == 0
    assert main(["materials", "check", "my_law.py", "--out", "checked"]) == 0
    text = Path("my_law.py").read_text(encoding="utf-8")
    assert text.startswith('"""My law: ')
    capsys.readouterr()
    for name, says in [
        ("my_law.py", "exists already; choose another"),
        ("my-law.py", "must be named like a Python module"),
        ("my_law.txt", "must be named like a Python module"),
        ("absent/my_law.py", "cannot be written (No such file"),
    ]:
        assert main(["materials", "new", name]) == 2
        assert says in capsys.readouterr().err
    assert Path("my_law.py").read_text(encoding="utf-8") == text


def test_check_writes_table_and_picture(mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["materials", "check", "mine.py", "--set", "mu=2e3"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^objective: .* yes +\S+ +1e-09$", said, re.MULTILINE)
    folder = Path("out/mine-check")
    found = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert found["parameters"] == {"mu": 2e3}
    assert all(p["passed"] in (True, None) for p in found["properties"])
    width, height = png_size(folder / "curves.png")
    assert width >= 1000
    assert height >= 600


def test_check_says_where_ellipticity_is_lost(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Saint Venant–Kirchhoff, ν = 0.3: J = 0.6687 (test_author_ellipticity); it is no failure."""
    wide = ["--stretch", "0.5", "1.2", "--volume", "0.6", "1.2", "--format", "svg"]
    assert main(["materials", "check", "saint_venant_kirchhoff", *wide]) == 0
    said = capsys.readouterr().out
    assert re.search(r"loses ellipticity at uniaxial stretch 0\.59\d, .*volume ratio 0\.669", said)
    assert re.search(r"^barrier: .* declared ", said, re.MULTILINE)
    picture = Path("out/saint_venant_kirchhoff-check/curves.svg").read_text(encoding="utf-8")
    assert picture.lstrip().startswith("<?xml")


@pytest.mark.parametrize(
    ("body", "says", "files"),
    [
        ("mu * (k.I1 - 3)", "sigma(I) = 0: 1, not at most 1e-06", ["result.json"]),
        ("mu / 2 * tr(k.E * k.E)", "barrier: psi", ["curves.png", "result.json"]),
    ],
)
def test_a_fault_exits_3_and_says_which(
    mine: Path, capsys: pytest.CaptureFixture[str], body: str, says: str, files: list[str]
) -> None:
    mine.write_text(HEAD + PSI + body + "\n", encoding="utf-8")
    assert main(["materials", "check", "mine.py"]) == 3
    assert f"not trustworthy: {says}" in capsys.readouterr().err
    assert sorted(f.name for f in Path("out/mine-check").iterdir()) == files


def test_fit_gives_back_what_made_the_data(
    rubber: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["mooney_rivlin", "--data", "rubber.csv", "--fix", "bulk=1e9"]
    assert main(["materials", "fit", *arguments]) == 0
    said = capsys.readouterr().out
    assert "body = supple.Body(mesh, 'mooney_rivlin', c1=" in said
    found = json.loads(Path("out/mooney_rivlin-fit/result.json").read_text(encoding="utf-8"))
    assert found["parameters"]["c1"]["value"] == pytest.approx(300.0, rel=1e-4)
    assert found["parameters"]["c2"]["value"] == pytest.approx(60.0, rel=1e-4)
    assert found["parameters"]["bulk"]["state"] == "fixed"
    assert found["r_squared"] > 0.9999999
    assert [s["mode"] for s in found["series"]] == ["uniaxial", "equibiaxial", "planar"]
    assert png_size(Path("out/mooney_rivlin-fit/fit.png"))[0] >= 1000


def test_a_file_for_each_test_is_the_same_as_one_of_all(rubber: Path) -> None:
    table = np.genfromtxt(rubber, delimiter=",", dtype=str)[1:]
    options = []
    for mode in ("uniaxial", "equibiaxial", "planar"):
        lines = ["strain_percent,stress_MPa"] + [
            f"{100 * float(x) - 100!r},{float(y) / 1e3!r}" for m, x, y in table if m == mode
        ]
        Path(f"{mode}.csv").write_text("\n".join(lines), encoding="utf-8")
        options += [f"--{mode}", f"{mode}.csv"]
    fixed = ["mooney_rivlin", "--fix", "bulk=1e9"]
    assert main(["materials", "fit", *fixed, *options, "--out", "one"]) == 0
    assert main(["materials", "fit", *fixed, "--data", "rubber.csv", "--out", "all"]) == 0
    one, other = (
        json.loads((Path(name) / "result.json").read_text(encoding="utf-8"))["parameters"]
        for name in ("one", "all")
    )
    assert one["c1"]["value"] == pytest.approx(other["c1"]["value"], rel=1e-9)


def test_data_that_cannot_tell_exits_3_and_writes_nothing(
    mine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("shear.csv").write_text("shear,stress_Pa\n0.1,50\n0.2,101\n0.3,149\n0.4,199\n", "utf-8")
    assert main(["materials", "fit", "mooney_rivlin", "--simple-shear", "shear.csv"]) == 3
    assert "bulk has no effect in these tests; fix one (--fix bulk=" in capsys.readouterr().err
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["neohookean"], "did you mean neo_hookean?"),
        (["chek", "mine.py"], "there is no command chek; did you mean check?"),
        (["--out", "out", "show", "mine.py"], "--out and --json go after show"),
        (["show"], "Missing argument 'NAME|FILE'"),
        (["check", "mine.py", "--set", "mu"], "--set must be NAME=VALUE, such as young=3e3"),
        (["check", "mine.py", "--set", "mu=1,2"], "--set must be NAME=VALUE"),
        (["check", "mine.py", "--set", "mu=1", "--set", "mu=2"], "--set gives mu twice"),
        (["check", "mine.py", "--set", "mu=-1"], "mu must lie in (0, inf) Pa, got -1"),
        (["check", "mine.py", "--stretch", "1.1", "2"], "stretch must go from below 1 to above"),
        (["check", "absent.py"], "absent.py: cannot be read"),
        (["fit", "mine.py"], "there is no data to fit; give --data FILE"),
        (["fit", "mine.py", "--data", "absent.csv"], "absent.csv: cannot be read"),
        (["fit", "mine.py", "--data", "rubber.csv", "--fix", "nu=1"], "has no parameter nu"),
    ],
)
def test_wrong_arguments_are_bad_input(
    rubber: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str
) -> None:
    assert main(["materials", *arguments]) == 2
    assert says in capsys.readouterr().err
    assert not Path("out").exists()


def test_help_shows_the_columns_of_a_file_on_lines_of_their_own(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["materials", "fit", "--help"]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert any(line.startswith("stretch   or strain") for line in lines)
    assert main(["materials", "--help"]) == 0
    listed = capsys.readouterr().out
    assert all(f"\n  {tool} " in listed for tool in ("show", "new", "check", "fit"))


def test_listing_is_quick() -> None:
    """Below 0.3 s for all that ship, once imported: nothing is computed for it."""
    import time

    supple.materials()
    start = time.perf_counter()
    supple.materials()
    assert time.perf_counter() - start < 0.3
