"""CMake builds what changed and nothing else; what there is to build it finds by itself.

Ninja decides for real; in the place of the generator stands a script that writes an empty C file.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(
    not (shutil.which("cmake") and shutil.which("ninja")), reason="needs CMake and Ninja"
)

PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(kernels_alone LANGUAGES C)
set(Python_EXECUTABLE {python})
include(cmake/kernels.cmake)
"""
#: Lists units as the generator does; of units it writes the least that compiles.
INSTEAD = f"""#!{sys.executable}
import os, pathlib, sys
if "--list" in sys.argv:
    os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
begin, end = sys.argv.index("--materials") + 2, sys.argv.index("--contract")
for unit in sys.argv[begin:end]:
    pathlib.Path(sys.argv[-1], unit + ".c").write_text("extern int nothing;")
"""


class Tree:
    """A copy of the kernels' part of the project, configured in its folder `build`."""

    def __init__(self, root: Path, folder: Path, laws: list[str], *settings: str) -> None:
        self.folder, self.build = folder, folder / "build"
        shutil.copytree(root / "cmake", folder / "cmake")
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(root / "kernels", folder / "kernels", ignore=ignored)
        for file in (*(f"materials/{law}.py" for law in laws), "cpp/include/supple/kernel.h"):
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(root / file, folder / file)
        python = folder / "python"
        python.write_text(INSTEAD, encoding="utf-8")
        python.chmod(0o755)
        (folder / "CMakeLists.txt").write_text(PROJECT.format(python=python), encoding="utf-8")
        given = [f"-D{s}" for s in ("SUPPLE_KERNEL_TARGETS=native", *settings)]
        self.run("cmake", "-G", "Ninja", "-S", folder, "-B", self.build, *given)

    def run(self, *command: object) -> str:
        words = [str(word) for word in command]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def rebuilt(self) -> set[str]:
        """Build; the units that were linked."""
        return set(re.findall(r"Linking C \S+ module kernels/native/(\S+)\.so", self.ninja()))

    def ninja(self, *words: str) -> str:
        return self.run("ninja", "-C", self.build, *words)

    def units(self) -> set[str]:
        """Those that Ninja knows, once it has looked whether its own file is up to date."""
        self.ninja("build.ninja")
        known = self.ninja("-t", "targets", "all")
        return set(re.findall(r"^kernels/native/(\S+)\.so:", known, re.M))

    def edit(self, file: str) -> None:
        path = self.folder / file
        path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")


@pytest.fixture(scope="module")
def tree(root, tmp_path_factory):
    """Built once: the demo's choice of the shipped laws."""
    laws = ["neo_hookean", "corotational_polar", "mooney_rivlin", "yeoh"]
    made = Tree(root, tmp_path_factory.mktemp("tree"), laws, "SUPPLE_AOT=demo")
    assert made.rebuilt() == made.units()
    return made


@pytest.mark.slow
def test_touching_nothing_rebuilds_nothing(tree):
    assert "no work to do" in tree.ninja()


@pytest.mark.slow
@pytest.mark.parametrize("law", ["neo_hookean", "corotational_polar", "mooney_rivlin", "yeoh"])
def test_touching_one_energy_rebuilds_its_units_alone(tree, law):
    """Those that begin with its name; none for one that is not compiled ahead."""
    tree.edit(f"materials/{law}.py")
    own = {name for name in tree.units() if name.startswith(f"{law}.")}
    assert tree.rebuilt() == own
    assert bool(own) == (law != "yeoh")
    assert "no work to do" in tree.ninja()


@pytest.mark.slow
@pytest.mark.parametrize("file", ["build.py", "checks.py", "__main__.py", "ahead.py", "targets.py"])
def test_what_writes_no_c_rebuilds_nothing(tree, file):
    tree.edit(f"kernels/{file}")
    assert tree.rebuilt() == set()


@pytest.mark.slow
def test_the_generator_and_the_contract_rebuild_all(tree):
    for file in ("kernels/forms/volume.py", "cpp/include/supple/kernel.h"):
        tree.edit(file)
        assert tree.rebuilt() == tree.units()


@pytest.mark.slow
def test_a_new_energy_needs_no_edit(root, tmp_path):
    """With -DSUPPLE_AOT=all: listed when its file appears, by what its file says at any time."""
    tree = Tree(root, tmp_path / "tree", ["neo_hookean"], "SUPPLE_AOT=all")
    assert "yeoh.P1.direct" not in tree.units()
    shutil.copy(root / "materials/yeoh.py", tree.folder / "materials/yeoh.py")
    assert tree.units() >= {"yeoh.P1.direct", "yeoh.P2.mixed_direct", "yeoh.P1.direct_sensitivity"}
    whole = (root / "materials/neo_hookean.py").read_text(encoding="utf-8")
    (tree.folder / "materials/yeoh.py").write_text(whole, encoding="utf-8")
    assert "yeoh.P1.direct" in tree.units()
    assert "yeoh.P2.mixed_direct" not in tree.units()


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names of x86 processors")
@pytest.mark.slow
def test_a_list_of_targets_is_compiled_into_a_folder_each(root, tmp_path):
    """Every unit for every target, for the processor that its folder is named after."""
    two = ("x86-64-v2", "x86-64-v3")
    laws = ["neo_hookean", "corotational_polar", "mooney_rivlin"]
    settings = ("SUPPLE_AOT=demo", f"SUPPLE_KERNEL_TARGETS={';'.join(two)}")
    tree = Tree(root, tmp_path / "tree", laws, *settings)
    tree.ninja()
    files = {t: {f.name for f in (tree.build / "kernels" / t).glob("*.so")} for t in two}
    assert files[two[0]] == files[two[1]]
    assert "neo_hookean.P1.direct.so" in files[two[0]]
    pattern = r"-march=(\S+) .* -o \S*/kernel_\w+?_(x86_64_v\d)\.dir/"
    compilations = re.findall(pattern, tree.ninja("-t", "commands"))
    assert len(compilations) == sum(map(len, files.values()))
    assert all(march.replace("-", "_") == folder for march, folder in compilations)


@pytest.mark.slow
def test_an_unknown_target_is_refused_with_those_that_there_are(root, tmp_path):
    settings = ("SUPPLE_AOT=demo", "SUPPLE_KERNEL_TARGETS=x86-64-v9")
    with pytest.raises(AssertionError, match=r"(?s)expected\s+some\s.*got\s+x86-64-v9"):
        Tree(root, tmp_path / "tree", ["neo_hookean"], *settings)


def test_what_cmake_runs_writes_one_whole_c_file_a_unit(root, tmp_path):
    """The real generator, as its command line is used; a wrong name is one sentence, no file."""
    contract = root / "cpp/include/supple/kernel.h"
    command = [sys.executable, "-m", "kernels", "--materials", root / "materials",
               "--contract", contract, "--out", tmp_path]  # fmt: skip
    home = {**os.environ, "PYTHONPATH": str(root)}
    subprocess.run([*command, "traction.T1", "pressure.T1"], env=home, check=True)
    assert {f.name for f in tmp_path.iterdir()} == {"traction.T1.c", "pressure.T1.c"}
    assert "supple_kernels" in (tmp_path / "traction.T1.c").read_text(encoding="utf-8")
    done = subprocess.run([*command, "traction.P1.T1"], env=home, capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.startswith("unit: expected law.element.form")
