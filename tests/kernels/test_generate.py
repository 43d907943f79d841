"""Generated libraries: what their table says, clean C, independent of where one stands."""

from __future__ import annotations

import re
import subprocess

import pytest

from supple import material
from supple.kernels import build, generate, unit
from supple.laws import _ahead


@pytest.fixture(scope="module")
def contract():
    return (_ahead() / "kernel.h").read_text(encoding="utf-8")


def source(name, contract):
    return generate.source(unit.parse(name, material("neo_hookean").path.parent), contract)


def statements(text):
    """The code without comments and without UFL's running numbers of meshes and coefficients."""
    return re.sub(r"\b([Jw])\d+_", r"\1_", re.sub(r"//.*", "", text))


def test_options_of_ffcx_in_the_working_folder_change_nothing(contract, tmp_path, monkeypatch):
    """FFCx reads ffcx_options.json where one stands; kernels must not."""
    before = statements(source("neo_hookean.P1.direct", contract))
    options = '{"scalar_type": "float32", "epsilon": 0.5}'
    (tmp_path / "ffcx_options.json").write_text(options, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert statements(source("neo_hookean.P1.direct", contract)) == before


def test_the_table_names_unit_law_and_fields(contract):
    """Name, the mark of file and generator, the fields with their sizes, all kernels of a solid."""
    from supple.kernels import fingerprint, reader

    text = source("mooney_rivlin.Q1.direct", contract)
    law = reader.read(material("mooney_rivlin").path)
    mark = fingerprint.mark(law.source_hash)
    assert f'"mooney_rivlin.Q1.direct", "{mark}", "Q1", 8, 0, LANES' in text
    fields = re.search(r"fields\[\] = \{(.*)\};", text)[1]
    assert fields == '{"u", 24}, {"c1", 1}, {"c2", 1}, {"bulk", 1}'
    for kernel in ("energy", "residual", "tangent", "volume_ratio", "points"):
        assert f'{{"{kernel}", ' in text


@pytest.mark.parametrize("name", ["neo_hookean.P1.direct", "neo_hookean.T1.skin_inverse",
                                  "pressure_moved.S1", "corotational_polar.P1.direct",
                                  "transversely_isotropic_mooney_rivlin.P1.direct"])  # fmt: skip
def test_generated_c_compiles_without_a_warning(name, contract, tmp_path):
    """-Wall -Werror."""
    (tmp_path / "k.c").write_text(source(name, contract), encoding="utf-8")
    command = [build._compiler(), "-std=c17", "-O0", "-Wall", "-Werror", "-fPIC", "-c", "k.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_helpers_stand_where_they_are_used(contract):
    """The exponential integral in a law that calls it, and in no other."""
    assert "exponential_integral" not in source("neo_hookean.P1.direct", contract)
    text = source("transversely_isotropic_mooney_rivlin.P1.direct", contract)
    assert text.count("static inline double exponential_integral(double x)") == 1


@pytest.mark.parametrize("wrong", ["neo_hookean", "neo_hookean.P9.direct", "neo_hookean.P1.up",
                                   "neo_hookean.P1.direct.q2.x", "traction.T1.T1"])  # fmt: skip
def test_a_name_that_is_no_unit_is_refused(wrong, tmp_path):
    with pytest.raises(ValueError, match=r"expected law\.element\.form"):
        unit.parse(wrong, tmp_path)


def test_names_of_units_are_read_back(tmp_path):
    """parse is the inverse of name, with and without degree and scheme."""
    for name in (
        *("neo_hookean.P1.direct", "mine.Q2.inverse.q6", "x.S2.skin_direct", "traction.T1"),
        *("x.Pr2.inverse.q6-gauss_jacobi", "x.Q2L.direct.q4-gll", "pressure_moved.S2L"),
    ):
        assert unit.parse(name, tmp_path).name == name
    assert len({u.name for u in unit.loads()}) == len(unit.loads()) == 3 * 7 + 4 * 5
