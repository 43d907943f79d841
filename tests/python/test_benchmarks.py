"""Benchmarks: tables follow from their rows, the inputs of peers are sound, small runs."""

from __future__ import annotations

import importlib
import json
import platform
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import supple
from supple import laws

#: A kernel library of one loop.
COUNTED = """
#include "kernel.h"
static void residual(double* A, const double* w, const double* x) {
  for (int i = 0; i < 10; ++i) A[0] += w[i] * x[0];
}
static const int numbers[] = {0};
static const supple_field fields[] = {{"u", 10}};
static const supple_kernel kernels[] = {{.name = "residual", .rows = 1, .cols = 1,
  .field_count = 1, .fields = numbers, .call = residual}};
static const supple_library table = {.nodes = 1, .lanes = 1, .field_count = 1, .fields = fields,
  .kernel_count = 1, .kernels = kernels};
const supple_library* supple_kernels(void) { return &table; }
"""


@pytest.fixture
def load(root: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Imports a script of benchmarks/ as the scripts import one another."""
    monkeypatch.syspath_prepend(str(root / "benchmarks" / "peers"))
    monkeypatch.syspath_prepend(str(root / "benchmarks"))

    def import_one(name: str) -> ModuleType:
        return importlib.import_module(name)

    return import_one


def answer(total: float, tip: tuple[float, float, float] = (1.0, 2.0, 3.0)) -> dict[str, Any]:
    return {"total": total, "assembly": total / 10, "factor": total / 2, "solve": total / 4,
            "iterations": 5, "dofs": 30, "residual": 1e-12, "tip": list(tip)}  # fmt: skip


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.012345, "0.0123"), (1.5, "1.50"), (123.4, "123"), (98765.0, "98800"), (None, None),
     (float("nan"), None), (1e-7, "1.00e-07")],
)  # fmt: skip
def test_numbers_have_three_digits(load: Any, value: float | None, text: str | None) -> None:
    assert load("output").digits(value) == text


@pytest.mark.parametrize("element", ["P1", "P2", "Q1", "Q2"])
def test_tip_of_a_quadratic_field_is_its_value_there(load: Any, element: str) -> None:
    """Every element's nodes, or the eight of a face without a centre, carry u = (y z, y², z) on."""
    case = load("peers.cantilever")
    mesh = supple.Mesh.box(case.DIVISIONS[element], (80.0, 15.0, 15.0), element)
    _, y, z = mesh.points.T
    found = case.tip(mesh.points, np.column_stack([y * z, y**2, z]))
    np.testing.assert_allclose(found, [7.5**2, 7.5**2, 7.5], rtol=1e-12)


@pytest.mark.parametrize("element", ["P1", "P2", "Q1", "Q2"])
def test_febio_input_is_xml_with_the_mesh_and_outward_facets(
    load: Any, tmp_path: Path, element: str
) -> None:
    """Every node and cell once, the loaded facets cover the face at x = 80 and look along +x."""
    load("newton").write_mesh(tmp_path / "m.npz", element, (3, 2, 2))
    case = dict(np.load(tmp_path / "m.npz"))
    text = load("peers.febio_input").text(case, element, "neo_hookean", (3e3, 0.3))
    root = ElementTree.fromstring(text.encode())
    nodes = [[float(x) for x in str(n.text).split(",")] for n in root.iter("node")]
    np.testing.assert_array_equal(nodes, case["points"])
    cells = [[int(x) for x in str(e.text).split(",")] for e in root.iter("elem")]
    np.testing.assert_array_equal(np.array(cells) - 1, case["cells"])
    facets = [[int(x) - 1 for x in str(f.text).split(",")] for f in root.find(".//Surface")]
    corners = 3 if element[0] == "P" else 4
    area = np.zeros(3)
    for facet in facets:
        p = case["points"][facet[:corners]]
        area += sum(np.cross(p[k] - p[0], p[k + 1] - p[0]) / 2 for k in range(1, corners - 1))
    np.testing.assert_allclose(area, [225.0, 0.0, 0.0], atol=1e-9)


def test_febio_log_is_read(load: Any) -> None:
    """Timers, iterations, and the root of the residual's square over the first one's."""
    log = """
      residual         2.0e+04    8.0e-17   2.0e-16
    Total number of equilibrium iterations .......... : 7
      Solve time ................... : 0:00:01 (1.5 sec)
        time evaluating stiffness .. : 0:00:00 (0.25 sec)
        time in linear solver ...... : 0:00:00 (0.75 sec)
    N O R M A L   T E R M I N A T I O N
    """
    points = np.array([[80.0, 7.5, 7.5]])
    found = load("peers.febio_newton").read(log, "*Step\n1 0.1 -0.2 0.3\n", points)
    assert found["iterations"] == 7
    assert (found["total"], found["assembly"], found["factor"]) == (1.5, 0.25, 0.75)
    assert found["tip"] == [0.1, -0.2, 0.3]
    assert found["residual"] == pytest.approx(np.sqrt(8e-17 / 2e4))


def test_ratios_are_of_rounds_and_to_the_best_peer(load: Any) -> None:
    """A round in which all took three times as long changes no ratio."""
    newton, team = load("newton"), load("team")
    ours, first, second = (team.Code(n, [], ours=not k) for k, n in
                           enumerate(("Supple, auto", team.REFERENCE, "FElupe")))  # fmt: skip
    case = newton.Case("P1", "neo_hookean", (1, 1, 1), Path())
    for code, total in ((ours, 0.1), (first, 0.4), (second, 0.2)):
        case.answers[code.name] = [answer(total * slow) for slow in (1.0, 3.0, 1.0)]
    rows = {r.code: r for r in newton.rows_of(case, [ours, first, second])}
    assert rows["Supple, auto"].over_best == pytest.approx(2.0)
    assert rows["Supple, auto"].assembly_over == pytest.approx(4.0)
    assert rows["FElupe"].over_best == pytest.approx(1.0)
    assert rows["Supple, auto"].iteration_ms == pytest.approx(20.0)
    text = newton.table(list(rows.values()), "a machine", ["FEBio: not given"])
    assert "| 20.0 [2.0 / 15.0] | 4.00 |" in text
    assert "Not measured: FEBio: not given" in text


def test_a_wrong_answer_is_not_timed(load: Any) -> None:
    newton, case = load("newton"), load("peers.cantilever")
    one = newton.Case("P1", "neo_hookean", case.DIVISIONS["P1"], Path())
    newton.require_right(one, "right", answer(1.0, case.TIPS["P1", "neo_hookean"]))
    with pytest.raises(SystemExit, match="off by"):
        newton.require_right(one, "wrong", answer(1.0))
    one.second_tips = {"a": [1.0, 2.0, 3.0], "b": [1.0, 2.0, 3.1]}
    with pytest.raises(SystemExit, match="second tips differ"):
        newton.require_agreement(one)


@pytest.mark.parametrize(
    ("mnemonic", "operands", "count"),
    [("vfmadd231pd", "%zmm1,%zmm2,%zmm3", 16), ("vaddpd", "(%rax){1to8},%zmm1,%zmm2", 8),
     ("vmulpd", "(%rdi),%ymm1,%ymm2", 4), ("vsqrtsd", "%xmm0,%xmm0,%xmm0", 1),
     ("vfnmadd132sd", "%xmm0,%xmm1,%xmm2", 2), ("vmovapd", "%zmm1,(%rax)", 0),
     ("vcvtsi2sd", "%eax,%xmm0,%xmm0", 0), ("divpd", "%xmm1,%xmm2", 2)],
)  # fmt: skip
def test_operations_of_an_instruction(load: Any, mnemonic: str, operands: str, count: int) -> None:
    assert load("flops").operations(mnemonic, operands) == count


@pytest.mark.skipif(platform.machine() != "x86_64", reason="single steps are x86's")
def test_operations_of_a_call_are_those_of_its_source(load: Any, tmp_path: Path) -> None:
    """Ten products and ten sums, as the loop says; its instructions are stepped through."""
    source, library = tmp_path / "k.c", tmp_path / "k.so"
    source.write_text(COUNTED, encoding="ascii")
    native = load("native")
    command = ["cc", "-O0", "-ffp-contract=off", "-fPIC", "-shared", f"-I{laws._ahead()}"]
    subprocess.run([*command, str(source), "-o", str(library)], check=True)
    c = native.load()
    table = c.open_library(str(library).encode())
    kernel, w, x = c.find(table, b"residual"), np.ones(10), np.ones(3)
    steps = np.zeros(2000, dtype=np.uint64)
    count = c.trace(table, kernel, w.ctypes.data, x.ctypes.data, steps.ctypes.data, len(steps))
    assert 20 < count < len(steps)
    assert load("flops").count(steps[:count]) == 20
    assert c.trace(table, kernel, w.ctypes.data, x.ctypes.data, steps.ctypes.data, 5) == 6
    assert c.time_calls(table, kernel, w.ctypes.data, x.ctypes.data, 1, 100) > 0


def test_exponents_of_growth_are_those_of_the_rows(load: Any) -> None:
    """Times 2 dofs^1.5, memory 5 dofs^0.9, whatever small sizes do."""
    growth = load("growth")
    rows = [
        growth.Row("direct", n, *[1.0 if n < 10_000 else 2 * n**1.5] * 8, 5 * n**0.9, 5, 0, 5)
        for n in (1000, 20_000, 50_000, 300_000)
    ]
    found = growth.exponents(rows)
    assert found["total"] == pytest.approx(1.5)
    assert found["megabytes"] == pytest.approx(0.9)
    assert "| **1.50** |" in growth.table(rows, "a machine", [])


def test_threads_are_powers_of_two_and_all_cores(load: Any) -> None:
    threads = load("threads")
    assert [threads.counts(n) for n in (1, 2, 6, 16)] == [[1], [1, 2], [1, 2, 4, 6],
                                                         [1, 2, 4, 8, 16]]  # fmt: skip


def test_page_holds_what_ran_and_says_what_did_not(load: Any, tmp_path: Path) -> None:
    run = load("run")
    (tmp_path / "newton.md").write_text("# Newton\n\ntable\n", encoding="utf-8")
    (tmp_path / "newton.json").write_text('{"rows": []}', encoding="utf-8")
    parts = [run.Done("newton", 3.0), run.Done("growth", 1.0, "status 1: no memory")]
    page = run.page(parts, tmp_path)
    assert "## Newton\n\ntable" in page
    assert "Not measured: status 1: no memory" in page
    assert run.collected(parts, tmp_path) == {"newton": {"rows": []}}


def test_the_smallest_block_grows_and_is_drawn(
    load: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    growth = load("growth")
    monkeypatch.setattr(growth, "EDGES", (3,))
    rows, left_out = growth.measure({"direct": 1000, "multigrid": 0}, 60.0)
    assert [r.dofs for r in rows] == [192]
    assert left_out == ["multigrid from 192 dofs on: --largest"]
    assert all(r.megabytes > 10 and r.total >= r.assembly > 0 for r in rows)
    load("growth_figure").draw(rows, tmp_path)
    assert (tmp_path / "growth.svg").stat().st_size > 1000


def test_supple_answers_a_request_on_its_standard_output(root: Path) -> None:
    """A line in, a line out: converged, the tip moves down under the load."""
    request = ('{"element": "P1", "law": "neo_hookean", "divisions": [4, 2, 2], "solver": "auto", '
               '"second": true}\n')  # fmt: skip
    script = [sys.executable, str(root / "benchmarks" / "supple_newton.py")]
    done = subprocess.run(script, input=request, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["dofs"] == 135
    assert found["residual"] < 1e-10
    assert found["second"]["residual"] < 1e-10
    assert found["tip"][1] < found["second"]["tip"][1] < 0  # stiffer the second time
