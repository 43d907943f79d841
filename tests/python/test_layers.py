"""The order of the modules holds: materials → kernels → cpp → _core → supple → cli.

Every import counts, wherever it stands in a file: inside functions, under `if TYPE_CHECKING`, or
as a name given to `importlib.import_module`.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

STANDARD = frozenset(sys.stdlib_module_names)
GENERATOR = ("basix", "ffcx", "ufl")


@dataclass(frozen=True)
class Layer:
    """Files under `folder`, which are imported as `package`, and what they may import.

    `allowed` None allows all that is not forbidden. Of the layers that hold a file, the one with
    the longest folder rules.
    """

    folder: str
    package: str
    allowed: frozenset[str] | None = None
    forbidden: tuple[str, ...] = field(default=())

    def refuses(self, module: str) -> bool:
        if any(_is_within(module, name) for name in self.forbidden):
            return True
        return self.allowed is not None and not any(_is_within(module, a) for a in self.allowed)


LAYERS = (
    Layer("materials", "supple.materials", frozenset({"supple.energy"})),
    Layer("kernels", "supple.kernels", STANDARD | {"numpy", "supple.kernels", *GENERATOR}),
    Layer("python/supple", "supple", None, ("supple.breast", "supple.cli", *GENERATOR)),
    Layer(
        "python/supple/breast",
        "supple.breast",
        None,
        ("supple.cli", "supple.kernels", "supple._core", *GENERATOR),
    ),
    Layer("python/supple/cli", "supple.cli"),
    Layer("python/supple/__main__.py", "supple.__main__"),
)


def _is_within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def _layer_of(path: str) -> Layer:
    holders = [a for a in LAYERS if path == a.folder or path.startswith(a.folder + "/")]
    return max(holders, key=lambda layer: len(layer.folder))


def _module_name(path: str, layer: Layer) -> list[str]:
    parts = path.removeprefix(layer.folder).removesuffix(".py").strip("/").split("/")
    return [*layer.package.split("."), *(p for p in parts if p)]


def _imports(tree: ast.AST, name: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Line and possible meanings of every import: `from a import b` may mean a or a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, [alias.name]) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = name[: -node.level] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((node.lineno, [stem, f"{stem}.{alias.name}"]) for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            targets = [a.value for a in node.args[:1] if isinstance(a, ast.Constant)]
            yield from ((node.lineno, [str(target)]) for target in targets)


def _is_refused(layer: Layer, meanings: list[str]) -> bool:
    if layer.allowed is None:
        return any(layer.refuses(meaning) for meaning in meanings)
    return layer.refuses(meanings[0]) and layer.refuses(meanings[-1])


def _python_violations(root: Path) -> Iterator[str]:
    for folder in ("materials", "kernels", "python/supple"):
        for file in sorted((root / folder).rglob("*.py")):
            path = file.relative_to(root).as_posix()
            layer = _layer_of(path)
            tree = ast.parse(file.read_text(encoding="utf-8"), path)
            for line, meanings in _imports(tree, _module_name(path, layer)):
                if _is_refused(layer, meanings):
                    yield f"{path}:{line}: {layer.folder} imports {meanings[-1]}"
            yield from _absolute_within_kernels(path, tree)


def _absolute_within_kernels(path: str, tree: ast.AST) -> Iterator[str]:
    """The generator runs before `supple` is installed, so it reaches its own files relatively."""
    if not path.startswith("kernels/"):
        return
    for node in ast.walk(tree):
        named = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and not node.level and node.module:
            named = [node.module]
        if any(_is_within(module, "supple") for module in named):
            yield f"{path}:{node.lineno}: kernels import each other relatively"


def _cpp_violations(root: Path) -> Iterator[str]:
    banned = re.compile(r'\s*#\s*include\s*[<"](Python\.h|pybind11/|numpy/|ufl)')
    for file in sorted((root / "cpp").rglob("*.[ch]pp")):
        path = file.relative_to(root).as_posix()
        if path.startswith("cpp/bindings/"):
            continue
        for number, text in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
            if banned.match(text):
                yield f"{path}:{number}: cpp includes Python: {text.strip()}"


def violations(root: Path) -> list[str]:
    """Every import and include under `root` that points up, as "file:line: what"."""
    return [*_python_violations(root), *_cpp_violations(root)]


def test_no_import_points_up(root: Path) -> None:
    found = violations(root)
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("materials/law.py", "from supple.mesh import Mesh"),
        ("materials/law.py", "import os"),
        ("kernels/forms/direct.py", "import scipy"),
        ("kernels/forms/direct.py", "from ...breast import tissues"),
        ("kernels/cells.py", "from supple.kernels import energy"),
        ("kernels/cells.py", "from . import elements\nfrom ..mesh import Mesh"),
        ("python/supple/body.py", "import supple.breast"),
        ("python/supple/body.py", "from supple import cli"),
        ("python/supple/body.py", "from . import breast"),
        ("python/supple/body.py", "def f():\n    from .breast.tissues import label"),
        ("python/supple/body.py", "import importlib\nimportlib.import_module('supple.cli')"),
        ("python/supple/body.py", "import ufl"),
        ("python/supple/registration/rigid.py", "from ..breast import tissues"),
        ("python/supple/breast/case.py", "from ..cli import main"),
        ("python/supple/breast/case.py", "from .. import _core"),
        ("cpp/src/mesh.cpp", "#include <pybind11/pybind11.h>"),
        ("cpp/include/supple/mesh.hpp", '#  include "Python.h"'),
    ],
)
def test_a_planted_import_that_points_up_is_found(tmp_path: Path, path: str, text: str) -> None:
    (tmp_path / path).parent.mkdir(parents=True)
    (tmp_path / path).write_text(text + "\n", encoding="utf-8")
    found = violations(tmp_path)
    assert len(found) >= 1
    assert found[0].startswith(f"{path}:{len(text.splitlines())}: ")


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("materials/law.py", "from supple.energy import Kinematics, Pa"),
        ("kernels/forms/direct.py", "import ufl\nimport numpy as np\nfrom ..cells import order"),
        ("python/supple/body.py", "from . import _core\nfrom .kernels import reader\nimport scipy"),
        ("python/supple/breast/case.py", "from .. import Body\nfrom ..registration import rigid"),
        ("python/supple/cli/predict.py", "from ..breast import predict\nimport click"),
        ("python/supple/__main__.py", "from .cli import main"),
        ("cpp/bindings/mesh.cpp", "#include <pybind11/pybind11.h>"),
        ("cpp/src/mesh.cpp", '#include <Eigen/Core>\n#include "supple/mesh.hpp"'),
    ],
)
def test_imports_that_follow_the_data_are_let_through(tmp_path: Path, path: str, text: str) -> None:
    (tmp_path / path).parent.mkdir(parents=True)
    (tmp_path / path).write_text(text + "\n", encoding="utf-8")
    assert violations(tmp_path) == []


def _fresh_import() -> tuple[float, set[str]]:
    """Seconds that `import supple` takes in a new process, and the modules that it loads."""
    code = (
        "import json, sys, time; start = time.perf_counter(); import supple; "
        "print(json.dumps([time.perf_counter() - start, sorted(sys.modules)]))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    seconds, modules = json.loads(run.stdout)
    return seconds, set(modules)


def test_import_supple_takes_at_most_300_ms() -> None:
    assert min(_fresh_import()[0] for _ in range(3)) <= 0.3


def test_import_supple_loads_nothing_heavy() -> None:
    heavy = {"SimpleITK", "cma", "matplotlib", "meshio", "plotly", "scipy", "skimage", *GENERATOR}
    ours = {"supple._core", "supple.breast", "supple.cli"}
    assert not _fresh_import()[1] & (heavy | ours)


def test_no_module_hides_a_public_name(root: Path) -> None:
    """A module imported first would take the place of the function of its name."""
    import supple

    files = {path.stem for path in (root / "python" / "supple").iterdir()}
    assert not files & set(supple.__all__)
