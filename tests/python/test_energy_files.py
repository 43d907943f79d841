"""Energy files: each fault gets one sentence with file, line and remedy; none of them runs."""

from __future__ import annotations

import re

import numpy as np
import pytest

import supple

HEAD = (
    '"""A law; its source."""\n'
    "from supple.energy import Direction, Kinematics, Pa, Ratio, inner, ln, tr\n\n\n"
)
GOOD = "    return young / 2 * (k.I1 - 3 - 2 * ln(k.J))\n"
PLAIN = "    return k.I1 - 3\n"
PSI = "def psi(k: Kinematics, young: Pa = 3e3):\n"
ESCAPE = "().__class__.__base__.__subclasses__()"
MESH = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")

#: Fault → text after the heading, line of the fault in that text, words of the sentence.
READING = {
    "import os": ("import os\n" + PSI + GOOD, 1, "something else than supple.energy; remove"),
    "from os": ("from os import system\n" + PSI + GOOD, 1, "something else than supple.energy"),
    "unknown import": ("from supple.energy import lam\n" + PSI + GOOD, 1, "did you mean lame"),
    "unknown name": (PSI + "    return youn * k.I1\n", 2, "unknown name youn; did you mean young"),
    "builtin": (PSI + "    return open(young)\n", 2, "unknown name open"),
    "unknown of k": (PSI + "    return young * k.I6\n", 2, "k has no I6; did you mean I"),
    "no default": ("def psi(k: Kinematics, young: Pa):\n" + GOOD, 1, "young needs a type and a"),
    "no type": ("def psi(k: Kinematics, young=3e3):\n" + GOOD, 1, "young: Pa = 1e3"),
    "unknown type": ("def psi(k, young: float = 1.0):\n" + GOOD, 1, "use Pa, Ratio, Number"),
    "default outside": ("def psi(k, young: Pa = -1.0):\n" + GOOD, 1, r"-1.0, outside \(0, inf\)"),
    "default no number": ("def psi(k, young: Pa = ln):\n" + GOOD, 1, "is not a number"),
    "wrong bounds": ("def psi(k, young: Pa(least=0.0) = 1.0):\n" + GOOD, 1, "bounds of young"),
    "reserved name": (PSI.replace("young", "u") + "    return u * k.I1\n", 1, "Supple's own"),
    "first argument": ("def psi(k=3, young: Pa = 1.0):\n" + GOOD, 1, "must begin with k"),
    "underscore": (PSI + "    return young * k.__class__\n", 2, "k has no __class__"),
    "dunder of a number": (PSI + "    return young.__class__\n", 2, "__class__ is not allowed"),
    "while": (PSI + "    while young:\n        young = 1\n" + GOOD, 2, "While is not allowed"),
    "for": (PSI + "    for i in range(3):\n        young = i\n" + GOOD, 2, "For is not allowed"),
    "if": (PSI + "    if young > 1:\n        young = 1\n" + GOOD, 2, "If is not allowed"),
    "endless power": (PSI + "    return young * 2 ** 2 ** 40\n", 2, "exponent must be at most 64"),
    "endless range": (
        PSI + "    return young * sum(i for i in range(10**12))\n",
        2,
        "range takes whole numbers",
    ),
    "string": (PSI + "    return young * 'x'\n", 2, "'x' is not a number"),
    "lambda": (PSI + "    return (lambda: young)()\n", 2, "Lambda is not allowed"),
    "comparison": (PSI + "    return young * (k.J > 1)\n", 2, "Compare is not allowed"),
    "two targets": (PSI + f"    a = tr[{ESCAPE}] = young\n" + GOOD, 2, "one return"),
    "subscript target": (PSI + f"    tr[{ESCAPE}] = young\n" + GOOD, 2, "else than names"),
    "helper's default": (f"def h(x, y={ESCAPE}):\n    return x\n\n\n" + PSI + GOOD, 1, "default"),
    "helper's decorator": (
        f"@{ESCAPE}\ndef h(x):\n    return x\n\n\n" + PSI + GOOD,
        2,
        "decorator",
    ),
    "exception": ('exceptions = {"barier"}\n' + PSI + GOOD, 1, "'barier'; did you mean barrier"),
    "exceptions twice": (f"exceptions = tr[{ESCAPE}] = 1\n" + PSI + GOOD, 1, "not allowed here"),
    "exceptions called": ("exceptions = set(ln)\n" + PSI + GOOD, 1, "must be a set"),
    "statement": ("ln(2.0)\n" + PSI + GOOD, 1, "Expr is not allowed here"),
    "class": ("class Psi:\n    pass\n" + PSI + GOOD, 1, "ClassDef is not allowed here"),
    "no return": (PSI + "    a = young\n", 1, "end it with return"),
    "not Python": (PSI + "    return young *\n", 2, "is not Python"),
    "psi_dev alone": (PSI.replace("psi", "psi_dev") + GOOD, None, "add psi_vol"),
    "direction too short": (
        "def psi(k, f: Direction = (1.0, 0.0)):\n" + PLAIN,
        1,
        r"default of f must be 3 number",
    ),
    "number too long": ("def psi(k, a: Pa = (1.0, 2.0)):\n" + PLAIN, 1, "must be 1 number"),
    "direction of no length": (
        "def psi(k, f: Direction = (0.0, 0.0, 0.0)):\n" + PLAIN,
        1,
        "outside three numbers, not",
    ),
    "open and closed": (
        "def psi(k, a: Pa(above=0.0, maximum=1.0) = 0.5):\n" + PLAIN,
        1,
        "bounds of",
    ),
    "no energy": ("def phi(k: Kinematics):\n    return k.J\n", None, "define psi"),
}

#: Faults that show in numbers, when the law is first compiled.
COMPUTING = {
    "not scalar": (PSI + "    return young * k.E\n", 1, r"a scalar but has shape \(3, 3\); contr"),
    "not objective": (PSI + "    return young * inner(k.F, k.F) + young * tr(k.F) - 6 * young\n", 1,
                      "the stress at F = I"),
    "not objective but stress free": (
        PSI + "    return young * (tr(k.F) - 3) ** 2 + young * inner(k.E, k.E)\n", 1,
        "is not objective: a rotation changes psi"),
    "energy at rest": (PSI + "    return young * k.I1 + young * tr(k.E) ** 2\n", 1,
                       r"psi at F = I is 9000 Pa, not 0; subtract"),
    "stress at rest": (PSI + "    return young * (k.I1 - 3)\n", 1,
                       r"stress at F = I is 6000 Pa, not 0;"),
    "method uncalled": (PSI + "    return k.I4\n", 1, "not a scalar"),
    "wrong arguments": (PSI + "    return inner(k.C, k.C, k.C)\n", 2, "TypeError: inner"),
    "division by zero": (PSI + "    return young / 0\n", 2, "division by zero"),
    "recursion": (PSI + "    return psi(k, young)\n", 2, "recursion"),
    "power of a tensor": (PSI + "    return young * tr(k.E**2)\n", 2, "cannot be computed"),
    "in-plane word in a solid": (PSI + "    return young * (k.I1_s - 3)\n", 1,
                                 "k.I1_s is of a membrane's plane; use it in psi_surface"),
    "no stiffness": (PSI + "    return 0 * young\n", 1, "no finite stiffness"),
    "not a number": (PSI + "    return young * ln(-k.J)\n", 1, "no finite stiffness"),
}  # fmt: skip


def written(folder, text):
    path = folder / "mine.py"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


def sentence(caught, path, line):
    """One sentence that begins with file and line, without a traceback in it."""
    said = str(caught.value)
    where = re.escape(str(path)) + (r":\d+: " if line is None else f":{line + 4}: ")
    assert re.match(where, said), said
    assert said.endswith((".", "?"))
    assert "\n" not in said


@pytest.mark.parametrize("fault", READING)
def test_a_wrong_file_is_refused_when_it_is_read(fault, tmp_path):
    text, line, says = READING[fault]
    path = written(tmp_path, text)
    for read in (supple.material, lambda p: supple.Body(MESH, p)):
        with pytest.raises(supple.MaterialError, match=says) as caught:
            read(path)
        sentence(caught, path, line)


@pytest.mark.parametrize("fault", COMPUTING)
def test_a_wrong_energy_is_refused_before_it_is_compiled(fault, tmp_path):
    text, line, says = COMPUTING[fault]
    path = written(tmp_path, text)
    body = supple.Body(MESH, path).fix(lambda p: p[:, 0] == 0)
    with pytest.raises(supple.MaterialError, match=says) as caught:
        body.solve()
    sentence(caught, path, line)


def test_a_file_without_docstring_or_of_no_text_is_refused(tmp_path):
    """Also one that is not there, and a folder."""
    path = tmp_path / "mine.py"
    for content, says in [
        ((PSI + GOOD).encode(), "has no docstring"),
        (b"", "docstring"),
        (b"\xff\xfe", "is not Python"),
        (b'"""a\x00"""', "is not Python"),
    ]:
        path.write_bytes(content)
        with pytest.raises(supple.MaterialError, match=says):
            supple.material(path)
    with pytest.raises(supple.MaterialError, match="cannot be read"):
        supple.material(tmp_path / "absent.py")
    (tmp_path / "folder.py").mkdir()
    with pytest.raises(supple.MaterialError, match="cannot be read"):
        supple.material(tmp_path / "folder.py")


SKIN = "def psi_surface(k: Kinematics, young: Pa = 3e3):\n"


@pytest.mark.parametrize(
    ("energy", "says"),
    [
        ("young * (k.I1_s - 2)", "psi_surface has a lateral tension of 6000 Pa at the stretches 1"),
        ("young * tr(k.E) ** 2 * k.J_s", "psi_surface has a lateral tension"),
        ("young * (k.I1_s + 1 / k.J_s**2)", "psi_surface at rest is 9000 Pa, not 0; subtract"),
        ("0 * young", "psi_surface has no finite stiffness at rest"),
        ("young * k.qr_strain[0, 0]", "k.qr_strain depends on the order of a cell's vertices"),
    ],
)
def test_a_wrong_skin_is_refused_before_it_is_compiled(energy, says, tmp_path):
    """Tension fields take the width 1/√λ for the one without lateral tension."""
    path = written(tmp_path, SKIN + f"    return {energy}\n")
    body = supple.Body(MESH, "neo_hookean").fix(lambda p: p[:, 0] == 0)
    body.skin(lambda p: p[:, 2] > 0.9, path, thickness=1e-3)
    with pytest.raises(supple.MaterialError, match=re.escape(says)) as caught:
        body.solve()
    sentence(caught, path, 1)


def test_an_energy_of_a_skin_alone_makes_no_solid(tmp_path):
    """Refused when the body is made, or a region; with the remedy."""
    path = written(tmp_path, SKIN + "    return young * (k.I1_s + 1 / k.J_s**2 - 3)\n")
    assert supple.material(path).parameters[0].name == "young"
    body = supple.Body(MESH, "neo_hookean")
    for make in (lambda: supple.Body(MESH, path), lambda: body.region([0], path)):
        with pytest.raises(supple.MaterialError, match=r"skin's energy .* give it to body\.skin"):
            make()


def test_declared_exceptions_let_a_law_pass(tmp_path, monkeypatch):
    """The same energy with its stress at rest declared compiles and works."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = written(
        tmp_path, 'exceptions = {"stress_free"}\n\n\n' + PSI + "    return young * k.I1\n"
    )
    energy, residual, _ = supple.assemble(supple.Body(MESH, path), np.zeros_like(MESH.points))
    assert energy == pytest.approx(9e3)
    assert abs(residual).max() > 1e2
    assert supple.material(path).exceptions == {"stress_free"}
