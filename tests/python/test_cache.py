"""Kernels compiled at first use: time, processes side by side or killed, what is not trusted."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import supple
from supple.kernels import build, fingerprint
from supple.kernels.unit import Unit

YEOH = '''"""Yeoh solid, nearly incompressible. Yeoh (1990), Rubber Chem. Technol. 63, eq. 3."""

from supple.energy import Kinematics, Number, Pa, log_volumetric


def psi_dev(k: Kinematics, c1: Pa = 500.0, c2: Number = 20.0, c3: Number = 1.0):
    terms = zip((c1, c2, c3), (1, 2, 3))
    return sum(c * (k.I1_bar - 3) ** n for c, n in terms)


def psi_vol(J, bulk: Pa = 1e4):
    return log_volumetric(J, bulk)
'''

IMPORT = "import time; a = time.perf_counter(); import supple; b = time.perf_counter()"
#: Prints the seconds of `import supple`, and of a body with its kernels loaded beyond that.
USE = f"""
{IMPORT}
import sys, numpy
mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
c = time.perf_counter()
body = supple.Body(mesh, sys.argv[1])
supple.assembly.system(body)
d = time.perf_counter()
assert not set(sys.modules) & {{"ufl", "ffcx", "basix"}} or "compile" in sys.argv
energy, residual, tangent = supple.assemble(body, 0.1 * mesh.points**2)
assert energy > 0 and abs(residual).max() > 0 and abs(tangent).max() > 0
print(b - a, d - c)
"""


@pytest.fixture
def yeoh(tmp_path):
    path = tmp_path / "elsewhere" / "yeoh.py"
    path.parent.mkdir()
    path.write_text(YEOH, encoding="utf-8")
    return path


@pytest.fixture
def home(tmp_path):
    """An empty cache for the processes that a test starts."""
    return {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache"), "OMP_NUM_THREADS": "1"}


def kernels(home):
    return Path(home["XDG_CACHE_HOME"]) / "supple" / "kernels"


def use(path, home, *flags):
    done = subprocess.run([sys.executable, "-c", USE, str(path), *flags], env=home,
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


def whole(folder):
    """The law's libraries; a load's are there too where nothing was compiled ahead."""
    return [f for f in folder.glob("yeoh.*") if build._is_whole(f)]


def test_an_energy_elsewhere_is_compiled_once_and_then_quick(yeoh, home):
    """First use ≤ 20 s; then in a new process ≤ 0.2 s more than `import supple`, itself ≤ 0.3 s.

    The best of some new processes counts, for other work on the machine only ever adds.
    """
    begin = time.perf_counter()
    use(yeoh, home, "compile")
    assert time.perf_counter() - begin <= 20
    assert len(whole(kernels(home))) == 1
    runs = [use(yeoh, home)]
    while len(runs) < 12 and not (runs[-1][0] <= 0.3 and runs[-1][1] <= 0.2):
        runs.append(use(yeoh, home))
    assert min(r[0] for r in runs) <= 0.3, runs
    assert min(r[1] for r in runs) <= 0.2, runs
    assert len(whole(kernels(home))) == 1


def test_two_processes_at_once_and_one_killed_leave_a_usable_cache(yeoh, home):
    """One is killed while it compiles, two others go on side by side: one library, and it works."""
    start = [sys.executable, "-c", USE, str(yeoh), "compile"]
    killed = subprocess.Popen(start, env=home, start_new_session=True, stderr=subprocess.DEVNULL)
    for _ in range(400):
        if list(kernels(home).glob(".compiling-*")) if kernels(home).exists() else []:
            break
        time.sleep(0.05)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    assert list(kernels(home).glob(".compiling-*"))
    assert not whole(kernels(home))
    pair = [
        subprocess.Popen(start, env=home, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    for process in pair:
        _, said = process.communicate(timeout=120)
        assert process.returncode == 0, said
    assert len(whole(kernels(home))) == 1
    use(yeoh, home)
    left = next(kernels(home).glob(".compiling-*"))
    os.utime(left, (0, 0))
    gone = kernels(home) / ".compiling-gone"  # as if its process took it away meanwhile
    gone.symlink_to("nowhere")
    yeoh.write_text(YEOH.replace("500.0", "501.0"), encoding="utf-8")
    use(yeoh, home, "compile")
    assert list(kernels(home).glob(".compiling-*")) == [gone]  # compilations sweep old ones


@pytest.fixture
def cache(tmp_path):
    """A cache with the fast-compiled pressure load in it: (unit, folder of kernel.h, cache, so)."""
    from supple.laws import _ahead

    ahead = tmp_path / "ahead"
    ahead.mkdir()
    contract = (_ahead() / "kernel.h").read_text(encoding="utf-8")
    (ahead / "kernel.h").write_text(contract, encoding="utf-8")
    folder = tmp_path / "kernels"
    folder.mkdir(mode=0o700)
    unit = Unit("traction", "T1")
    return unit, ahead, folder, build.library(unit, ahead, folder)


def test_a_changed_library_is_never_loaded(cache):
    """A byte more in the file, or its hash gone: compiled anew, not loaded."""
    unit, ahead, folder, library = cache
    first = library.read_bytes()
    for spoil in (lambda: library.write_bytes(first + b"x"), (library.parent / "sha256").unlink):
        spoil()
        assert build.library(unit, ahead, folder) == library
        assert library.read_bytes() != first + b"x"
        assert build._is_whole(library.parent)


def test_an_intact_library_is_not_compiled_again(cache, monkeypatch):
    """A hit touches neither generator nor compiler."""
    unit, ahead, folder, library = cache

    def refuse(*_):
        raise AssertionError("compiled again")

    monkeypatch.setattr(build, "_compile", refuse)
    assert build.library(unit, ahead, folder) == library


def test_a_library_of_another_generator_is_not_used(cache, monkeypatch):
    """Compiled ahead, then kernels/*.py change: its energy is the same, yet the mark is not."""
    unit, ahead, folder, library = cache
    built = ahead / "native" / "traction.T1.so"
    built.parent.mkdir()
    built.write_bytes(library.read_bytes())
    assert build.library(unit, ahead, folder) == built
    monkeypatch.setattr(fingerprint, "_generator", lambda: "newer")
    assert build.library(unit, ahead, folder) == library


def test_a_change_of_the_generator_changes_the_mark():
    """Every file of kernels/ counts, but those that write no C: listing, building, refusing."""
    sources = {f.name for f in fingerprint.sources()}
    assert {"generate.py", "volume.py", "elements.py", "kinematics.py", "parts.py"} <= sources
    assert not sources & {"build.py", "ahead.py", "checks.py", "__main__.py", "targets.py"}
    assert fingerprint.mark("a") != fingerprint.mark("b")


@pytest.mark.parametrize("mode", [0o777, 0o720, 0o702])
def test_a_cache_that_others_can_write_is_refused(cache, mode):
    """With the command that mends it; after that it is used."""
    unit, ahead, folder, library = cache
    folder.chmod(mode)
    with pytest.raises(build.BuildError, match=f"chmod 700 {folder}"):
        build.library(unit, ahead, folder)
    folder.chmod(0o700)
    assert build.library(unit, ahead, folder) == library


def test_the_cache_folder_is_made_for_its_owner_alone(yeoh, home):
    """0700 from the start."""
    use(yeoh, home, "compile")
    assert kernels(home).stat().st_mode & 0o777 == 0o700


def test_another_energy_of_a_shipped_name_is_not_mistaken_for_it(tmp_path, monkeypatch):
    """A file called neo_hookean.py with another ψ: its own kernels, not those compiled ahead."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "neo_hookean.py"
    text = supple.material("neo_hookean").path.read_text(encoding="utf-8")
    path.write_text(
        text.replace("mu / 2 * (k.I1 - 3)", "mu / 2 * (k.I1 - 3) ** 2 + mu / 2 * (k.I1 - 3)")
    )
    mesh = supple.Mesh.box((1, 1, 1), (1.0, 1.0, 1.0), "P1")
    ours, theirs = (
        supple.assemble(supple.Body(mesh, law), 0.1 * mesh.points**2)[0]
        for law in ("neo_hookean", path)
    )
    assert theirs > 1.001 * ours


def test_import_needs_neither_the_compiled_part_nor_the_generator():
    """`import supple` loads no numpy, UFL, FFCx or SciPy."""
    heavy = "numpy scipy ufl ffcx basix supple._core plotly SimpleITK skimage meshio"
    code = f"import sys, supple; print([m for m in {heavy.split()!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
