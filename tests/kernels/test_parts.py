"""A long kernel in parts computes what the whole one does, and each part is short."""

from __future__ import annotations

import ctypes
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from supple import material
from supple.kernels import build, generate, parts, unit
from supple.laws import _ahead

#: Solid, with branches, and one whose every value depends on the point.
UNITS = ("neo_hookean.P1.direct", "neo_hookean.T1.skin_direct", "neo_hookean.Q1.inverse")


def tabulate(name, folder, plain):
    """The unit's tangent (rows × cols) at a moved, distorted cell, in every lane, and its C."""
    contract = (_ahead() / "kernel.h").read_text(encoding="utf-8")
    chosen = replace(unit.parse(name, material("neo_hookean").path.parent), plain=plain)
    text = generate.source(chosen, contract)
    forms = generate._forms(chosen)
    folder.mkdir()
    exported = text.replace("static void tangent(", "void tangent(")
    (folder / "k.c").write_text(f"{exported}\nconst int lanes = LANES;\n")
    flags = ["-O1" if f == "-O2" else f for f in build.FLAGS if f != "-fvisibility=hidden"]
    command = [build._compiler(), *flags, "-Wall", "-Werror", "k.c", "-o", "k.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    u = forms.fields["u"].ufl_function_space().ufl_element()
    points = np.zeros((u.dim // 3, 3))
    points[:, : u.basix_element.points.shape[1]] = u.basix_element.points
    rng = np.random.default_rng(3)
    points += 0.1 * rng.uniform(-1, 1, points.shape)
    sizes = [generate._size(field) for field in forms.fields.values()]
    w = np.concatenate([0.1 * rng.uniform(-1, 1, sizes[0]), np.linspace(0.2, 0.3, sum(sizes[1:]))])
    library = ctypes.CDLL(str(folder / "k.so"))
    lanes = ctypes.c_int.in_dll(library, "lanes").value
    arrays = [aligned(a, lanes) for a in (np.zeros(u.dim**2), w, points.ravel())]
    library.tangent(*(a.ctypes.data_as(ctypes.c_void_p) for a in arrays))
    return arrays[0].reshape(-1, lanes), text


def aligned(values, lanes):
    """[entry][lane], the same in every lane, at a multiple of 64 bytes."""
    store = np.empty(values.size * lanes + 8)
    start = -store.ctypes.data % 64 // 8
    array = store[start : start + values.size * lanes]
    array[:] = np.repeat(values, lanes)
    return array


@pytest.mark.parametrize("plain", [False, True])
@pytest.mark.parametrize("name", UNITS)
def test_a_kernel_in_parts_gives_the_same_values(name, plain, tmp_path, monkeypatch):
    """Cut at 200 definitions, into parts of at most 150: as the uncut one, to rounding."""
    whole, text = tabulate(name, tmp_path / "whole", plain)
    assert "noinline)) void" not in text
    monkeypatch.setattr(parts, "LONGEST", 200)
    monkeypatch.setattr(parts, "PART", 150)
    cut, text = tabulate(name, tmp_path / "cut", plain)
    functions = re.findall(r"noinline\)\) void (\w+)\(.*?\n}\n", text, re.DOTALL)
    assert len(functions) >= 5
    assert np.abs(whole).max() > 0
    assert np.abs(cut - whole).max() <= 1e-13 * np.abs(whole).max()


def test_no_part_is_longer_than_asked(monkeypatch):
    """1001 definitions in parts of at most 100: 11, of 91 each, and the last one is shorter."""
    monkeypatch.setattr(parts, "LONGEST", 500)
    monkeypatch.setattr(parts, "PART", 100)
    chain = [f"double s{i + 1} = s{i} * w[{i}];" for i in range(1001)]
    body = "\n".join(["double s0 = 1.0;", *chain, "A[0] += s1001;"])
    functions, rest = parts.in_parts("k", body)
    lengths = [len(re.findall(r"^double", f, re.MULTILINE)) for f in functions.split("}\n")[:-1]]
    assert max(lengths) == 92
    assert sum(lengths) == 1002
    assert len(lengths) == 11
    assert rest.endswith("A[0] += s1001;")


def test_tables_of_shape_functions_stay_where_they_are(monkeypatch):
    """A run that reads another array than w is left whole: that array is not passed on."""
    monkeypatch.setattr(parts, "LONGEST", 10)
    body = "\n".join(f"double s{i} = w[{i}] * FE0_Q4[0][0][iq][{i}];" for i in range(50))
    assert parts.in_parts("k", body) == ("", body)
