"""Of kernels compiled ahead for several processors the best is taken that this one runs."""

from __future__ import annotations

import pytest

from supple.kernels import build, fingerprint, targets
from supple.kernels.unit import Unit

#: Flags as Linux shows them, made up of what each generation added.
NEHALEM = frozenset(
    ["fpu", "sse2", "cx16", "lahf_lm", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"]
)
HASWELL = NEHALEM | frozenset(
    ["avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave", "erms"]
)
SKYLAKE_SERVER = HASWELL | frozenset(["avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"])
KNIGHTS_LANDING = HASWELL | frozenset(["avx512f", "avx512cd", "avx512er", "avx512pf"])
ARM = frozenset(["fp", "asimd", "crc32"])


@pytest.fixture
def folder(tmp_path):
    """Two targets, as a wheel to hand out may have."""
    for name in ("x86-64-v2", "x86-64-v3"):
        (tmp_path / name).mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("flags", "picked"),
    [
        (frozenset(), None),  # no Linux to ask
        (frozenset({"sse2"}), None),  # older than the oldest target
        (NEHALEM, "x86-64-v2"),
        (HASWELL - {"fma"}, "x86-64-v2"),
        (HASWELL, "x86-64-v3"),
        (KNIGHTS_LANDING, "x86-64-v3"),
        (SKYLAKE_SERVER, "x86-64-v3"),
        (ARM, None),
    ],
)
def test_the_best_target_that_the_flags_allow_is_picked(folder, flags, picked):
    """By the flags that each level of the x86-64 ABI asks for, and by nothing else."""
    assert targets.best(folder, flags) == (folder / picked if picked else None)


def test_what_was_built_for_this_machine_goes_first(folder):
    """A build that stays where it is has one folder, whatever the processor says."""
    (folder / "native").mkdir()
    assert targets.best(folder, frozenset()) == folder / "native"


def test_a_library_comes_from_the_picked_folder(folder, monkeypatch):
    """`build.library` returns that target's file; on a weaker processor the weaker one's."""
    unit = Unit("traction", "T1")
    for target in folder.iterdir():
        (target / f"{unit.name}.so").write_text(fingerprint.mark(""), encoding="ascii")
    for flags, target in ((HASWELL, "x86-64-v3"), (NEHALEM, "x86-64-v2")):
        monkeypatch.setattr(targets, "flags", lambda flags=flags: flags)
        assert build.library(unit, folder) == folder / target / "traction.T1.so"
