"""Test data from CSV: every unit and heading, and each fault named by row and column."""

from __future__ import annotations

import numpy as np
import pytest

import supple
from supple.author import data
from supple.author.modes import mode_of


def read(folder, text, mode=None):
    file = folder / "test.csv"
    file.write_text(text, encoding="utf-8")
    return data.read_csv(file, None if mode is None else mode_of(mode))


@pytest.mark.parametrize(
    ("heading", "row", "value", "stress", "kind"),
    [
        ("stretch,stress_Pa", "1.25,2000", 1.25, 2e3, "nominal"),
        ("strain,nominal_stress_kPa", "0.25,2", 1.25, 2e3, "nominal"),
        ("Strain [%],Engineering stress (MPa)", "25,0.002", 1.25, 2e3, "nominal"),
        ("strain_percent,true_stress_GPa", "25,2e-6", 1.25, 2e3, "cauchy"),
        ("true strain,Cauchy stress [kpa]", f"{np.log(1.25)},2", 1.25, 2e3, "cauchy"),
        ("nominal_stress_kPa,stretch,weight", "2,1.25,3", 1.25, 2e3, "nominal"),
    ],
)
def test_headings_say_measure_and_unit(tmp_path, heading, row, value, stress, kind):
    (series,) = read(tmp_path, f"{heading}\n{row}\n", "uniaxial")
    assert series.values == pytest.approx([value])
    assert series.stress == pytest.approx([stress])
    assert (series.mode.name, series.kind) == ("uniaxial", kind)
    assert series.weight == pytest.approx([3.0 if "weight" in heading else 1.0])


def test_a_row_takes_the_columns_of_its_own_test(tmp_path):
    """Comments and empty lines are skipped; a stretch of a volumetric row is its cube's."""
    text = (
        "# silicone, batch 7\nmode,stretch,shear,volume_ratio,stress_kPa,pressure_MPa\n"
        "uniaxial,1.1,,,0.3,\n\nsimple shear,,0.4,,1.5,\nVolumetric,,,0.9,,0.2\n"
        "uniaxial,1.2,,,0.5\nvolumetric,0.5,,,,2\n"
    )
    uniaxial, shear, volume = read(tmp_path, text)
    assert uniaxial.values.tolist() == [1.1, 1.2]
    assert uniaxial.stress.tolist() == [300.0, 500.0]
    assert (shear.values.tolist(), shear.stress.tolist()) == ([0.4], [1500.0])
    assert volume.kind == "pressure"
    np.testing.assert_allclose(volume.values, [0.9, 0.125])
    np.testing.assert_allclose(volume.stress, [2e5, 2e6])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty; begin with a heading"),
        ("stretch,stress_Pa\n1.1,2\n", "has no column 'mode'; add it, or name the test"),
        ("mode,stretch,stress\nuniaxial,1.1,2\n", "unknown column 'stress'; there are .*_kPa"),
        ("mode,stretch,stress_mPa\nuniaxial,1.1,2\n", "unknown column 'stress_mpa'"),
        ("mode,stretch\nuniaxial,1.1\n", "has no column of stress"),
        ("mode,stretch,stretch,stress_Pa\n", "a column stands twice"),
        ("mode,stretch,stress_Pa\n", "has no rows of data"),
        ("mode,stretch,stress_Pa\nuniaxial,1.1,2\nuniaxial,x,2\n",
         "row 3, column stretch: expected a number, got 'x'"),
        ("mode,stretch,stress_Pa\nuniaxial,1.1,nan\n", "row 2, column stress_Pa: must be finite"),
        ("mode,stretch,stress_Pa\nuniaxial,-0.1,1\n", "column stretch: means a stretch of -0.1"),
        ("mode,strain_percent,stress_Pa\nuniaxial,-100,1\n", "means a stretch of 0, not above 0"),
        ("mode,stretch,stress_Pa\nbiaxial,1.1,1\n", "row 2, column mode: mode must be one of"),
        ("mode,stretch,stress_Pa\nsimple_shear,1.1,1\n", "column shear: is missing; a simple"),
        ("mode,stretch,stress_Pa\nvolumetric,0.9,1\n", "column pressure_Pa: is missing"),
        ("mode,stretch,stress_Pa\nuniaxial,1.1,\n", "column nominal_stress_Pa: is missing"),
        ("mode,stretch,stress_Pa\nuniaxial,1.1,1,5\n", "row 2: has 4 cells, but the heading has 3"),
        ("mode,stretch,stress_Pa,weight\nuniaxial,1.1,1,-1\n", "column weight: must be at least 0"),
    ],
)  # fmt: skip
def test_a_wrong_file_names_row_and_column(tmp_path, text, says):
    with pytest.raises(supple.InputError, match=says) as caught:
        read(tmp_path, text)
    assert str(tmp_path / "test.csv") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(supple.InputError, match=r"absent.csv: cannot be read"):
        data.read(tmp_path / "absent.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(supple.InputError, match=r"binary.csv: cannot be read"):
        data.read({"uniaxial": tmp_path / "binary.csv"})
