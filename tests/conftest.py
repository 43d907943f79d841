"""What every test may ask for."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent

#: Compiles the units named on its command line, or finds them compiled.
_COMPILE = """
import sys
from supple.kernels.unit import parse
from supple.laws import compiled, folder
for name in sys.argv[1:]:
    compiled(parse(name, folder()))
"""


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository's root folder."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference numbers and data beside the repository; skips where it is absent."""
    folder = ROOT.parent / "shared"
    if not folder.is_dir():
        pytest.skip(f"needs the data folder {folder}, which is not part of the repository")
    return folder


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """All tests of one kernel library run in one process, so that it is compiled once."""
    for item in items:
        unit = getattr(item, "callspec", None) and item.callspec.params.get("unit")
        if isinstance(unit, str):
            item.add_marker(pytest.mark.xdist_group(unit))


@pytest.fixture(scope="session")
def compiled_units(request: pytest.FixtureRequest) -> None:
    """Every kernel library that the chosen tests name in their parameter ``unit``, compiled.

    Where tests run in several processes, each test compiles its own: all are busy anyway.
    """
    if hasattr(request.config, "workerinput"):
        return
    names = sorted(
        {
            item.callspec.params["unit"]
            for item in request.session.items
            if "compiled_units" in getattr(item, "fixturenames", ())
            and "unit" in getattr(getattr(item, "callspec", None), "params", {})
        }
    )
    halves = [subprocess.Popen([sys.executable, "-c", _COMPILE, *names[k::2]]) for k in (0, 1)]
    assert [half.wait() for half in halves] == [0, 0]


@pytest.fixture
def quick_compiler(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The slow ones without optimisation: the same C, in a quarter of the compiler's time."""
    from supple.kernels import build

    if request.node.get_closest_marker("slow"):
        flags = tuple("-O0" if flag == build.OPTIMISATION[0] else flag for flag in build.FLAGS)
        monkeypatch.setattr(build, "FLAGS", flags)


@pytest.fixture(scope="session")
def distorted() -> Callable:
    """distorted(element, cells=(1, 1, 1), curved=True, seed=0): a unit box, every node moved.

    Corners by up to 0.12 of a cell, so no hexahedron or prism is affine; at degree 2 every other
    node by up to 0.02 more, so that edges and faces are curved, if ``curved``.
    """
    from supple import Mesh

    def make(element: str, cells: tuple = (1, 1, 1), curved: bool = True, seed: int = 0) -> Mesh:
        rng = np.random.default_rng(seed)
        mesh = Mesh.box(cells, (1.0, 1.0, 1.0), element.rstrip("12L") + "1")
        step = 1 / np.array(cells)
        mesh = mesh.moved(mesh.points + 0.12 * step * rng.uniform(-1, 1, mesh.points.shape))
        if element == mesh.element:
            return mesh
        mesh = mesh.elevated(element)
        if not curved:
            return mesh
        return mesh.moved(mesh.points + 0.02 * step * rng.uniform(-1, 1, mesh.points.shape))

    return make


@pytest.fixture(scope="session")
def assert_slope() -> Callable:
    """assert_slope(f, slope, x, d, h): ``slope`` is the derivative of f at x along d.

    Central differences at h and h/10 miss it by errors that fall as h² down to f's own rounding
    over the step, or by rounding alone where f is a polynomial of degree 2; Richardson's
    extrapolation of the two meets it.
    """

    def check(f: Callable, slope: object, x: np.ndarray, d: np.ndarray, h: float) -> None:
        size = np.abs(slope).max()
        assert size > 0
        coarse, fine = ((f(x + e * d) - f(x - e * d)) / (2 * e) - slope for e in (h, h / 10))
        errors = [np.abs(e).max() / size for e in (coarse, fine)]
        extrapolated = np.abs(100 * fine - coarse).max() / (99 * size)
        assert extrapolated < 1e-4, (extrapolated, errors)
        rounding = 8 * np.finfo(float).eps * np.abs(f(x)).max() / (h / 10) / size
        falls = errors[1] < errors[0] / 50 + rounding
        assert falls or max(errors) < 1e-9, f"not of order 2: {errors}"

    return check


@pytest.fixture(scope="session")
def rotation() -> np.ndarray:
    """A rotation (3, 3) by 1.1 rad about an axis in general position (Rodrigues)."""
    axis = np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
    K = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(1.1) * K + (1 - np.cos(1.1)) * K @ K
