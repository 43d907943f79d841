"""What is compiled ahead of time: all that a law can take, from its file alone."""

from __future__ import annotations

import subprocess
import sys

import pytest

from supple import material
from supple.kernels import ahead, reader, unit

NEW = '''"""A new law."""

from supple.energy import Kinematics, Pa, log_volumetric


def psi_dev(k: Kinematics, mu: Pa = 1e3):
    return mu / 2 * (k.I1_bar - 3)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
'''


@pytest.fixture(scope="module")
def materials():
    return material("neo_hookean").path.parent


def taken(name, materials):
    """{form: elements} of a shipped law."""
    units = ahead.of_law(reader.read(materials / f"{name}.py"))
    return {u.form: {v.element for v in units if v.form == u.form} for u in units}


@pytest.mark.parametrize(
    ("law", "formulations", "skins"),
    [
        ("neo_hookean", {""}, True),  # psi as a whole
        ("mooney_rivlin", {"", "mixed_", "mean_dilatation_"}, True),  # in its parts
        ("corotational_qr", {""}, False),  # not isotropic
        ("holzapfel_ogden", {"", "mixed_", "mean_dilatation_"}, False),
        ("fung_skin", set(), True),  # psi_surface alone
    ],
)
def test_a_law_takes_what_its_file_says(law, formulations, skins, materials):
    """No mixed form without psi_dev, no skin of an anisotropic law, no solid of a skin's."""
    found = taken(law, materials)
    wanted = formulations | ({"skin_"} if skins else set())
    assert set(found) == {f"{prefix}{way}" for prefix in wanted for way in ("direct", "inverse")}
    on = {"": set(unit.SOLIDS), "skin_": set(unit.FACETS), "mixed_": {"P2", "Q2L"}}
    on["mean_dilatation_"] = {"Q1"}
    for prefix in wanted:
        assert found[f"{prefix}direct"] == found[f"{prefix}inverse"] == on[prefix]


def test_all_holds_the_demo_every_law_and_their_sensitivities(materials):
    """Each once, by a name that is read back."""
    names = [u.name for u in ahead.everything(materials)]
    assert len(names) == len(set(names))
    assert set(names) >= {u.name for u in ahead.demo(materials)}
    plain = [n for n in names if "sensitivity" not in n]
    assert len(names) == 2 * len(plain)
    laws = {n.split(".")[0] for n in plain if n.count(".") == 2}
    assert laws == {f.stem for f in materials.glob("*.py")} - {"__init__"}
    for name in names:
        assert unit.parse(name, materials).name == name


def test_a_new_energy_file_is_found_by_itself(tmp_path):
    """Laid into a folder: listed with all that it takes; a wrong one is refused with its line."""
    before = len(ahead.everything(tmp_path))
    (tmp_path / "new.py").write_text(NEW, encoding="utf-8")
    names = {u.name for u in ahead.everything(tmp_path)}
    solids, skins = 2 * len(unit.SOLIDS), 2 * len(unit.FACETS)
    assert len(names) == before + 2 * (solids + skins + 2 * 2 + 2)
    assert {"new.P1.direct", "new.Q2L.mixed_inverse", "new.T1.skin_direct_sensitivity"} <= names
    (tmp_path / "wrong.py").write_text(NEW.replace("I1_bar", "I9_bar"), encoding="utf-8")
    with pytest.raises(reader.EnergyFileError, match=r"wrong\.py:\d+: k has no I9_bar"):
        ahead.everything(tmp_path)


def test_the_list_needs_no_generator(materials):
    """CMake asks at every configuration: neither UFL nor FFCx nor Basix is imported for it."""
    code = (
        "import sys, pathlib; from supple.kernels import ahead; "
        f"ahead.as_cmake('all', pathlib.Path({str(materials)!r})); "
        "print([m for m in ('ufl', 'ffcx', 'basix') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
