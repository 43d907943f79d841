"""A strain energy as read from its file: its parameters, and its functions ready to be called."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import CodeType
from typing import Any

from . import energy
from .kinematics import Unavailable

#: Properties of an energy that a file may declare not to have; tests then demand their absence.
EXCEPTIONS = ("stress_free", "objective", "isotropic", "barrier")
#: Functions by which an energy file speaks.
ENTRY_POINTS = ("psi", "psi_dev", "psi_vol", "psi_surface")
#: The only functions of Python's own that an energy file may call.
BUILTINS: dict[str, Any] = {"sum": sum, "zip": zip, "range": range, "abs": abs}


class EnergyFileError(Exception):
    """An energy file that cannot be used: one sentence with file, line and remedy."""


@contextmanager
def blamed(law: Law) -> Iterator[None]:
    """Whatever the law's own expressions raise becomes an EnergyFileError with their line."""
    try:
        yield
    except EnergyFileError:
        raise
    except Unavailable as problem:
        raise EnergyFileError(f"{law.path}:{law.line}: {problem}") from None
    except Exception as problem:
        frames = traceback.extract_tb(problem.__traceback__)
        line = next((f.lineno for f in frames[::-1] if f.filename == str(law.path)), law.line)
        raise EnergyFileError(
            f"{law.path}:{line}: cannot be computed ({type(problem).__name__}: {problem}); "
            "check the shapes and arguments of its expression."
        ) from problem


@dataclass(frozen=True)
class Parameter:
    """One parameter of a law: SI unit, default and admissible range."""

    name: str
    kind: energy.Kind
    default: Any

    @property
    def unit(self) -> str:
        return self.kind.unit


@dataclass(frozen=True)
class Law:
    """A strain energy as read from its file.

    Attributes:
        name: file name without suffix.
        path: where it was read.
        reference: first line of its docstring: formula and source.
        parameters: in the order of the kernels' coefficients.
        exceptions: subset of EXCEPTIONS.
        source_hash: hash of its text, the law's part of the cache key.
        line: where its energy is defined.
    """

    name: str
    path: Path
    reference: str
    parameters: tuple[Parameter, ...]
    exceptions: frozenset[str]
    source_hash: str
    line: int
    _code: CodeType = field(repr=False, compare=False)

    @cached_property
    def _functions(self) -> dict[str, Callable[..., Any]]:
        words = {name: getattr(energy, name) for name in energy.__all__}
        space: dict[str, Any] = {"__builtins__": {}, **BUILTINS, **words}
        exec(self._code, space)  # every node was checked against the whitelist
        return {n: space[n] for n in ENTRY_POINTS if callable(space.get(n))}

    @property
    def solid(self) -> bool:
        """Whether it has an energy per volume; one with psi_surface alone is a skin's."""
        return bool({"psi", "psi_dev"} & set(self._functions))

    @property
    def surface(self) -> bool:
        """Whether it has an energy of its own for a skin."""
        return "psi_surface" in self._functions

    def arguments(self, function: str, values: dict[str, Any]) -> dict[str, Any]:
        """Those of ``values`` (name → value) that ``function`` takes."""
        names = inspect.signature(self._functions[function]).parameters
        return {n: values[n] for n in names if n in values}

    def psi(self, k: Any, values: dict[str, Any]) -> Any:
        """ψ per rest volume, Pa, at the kinematics ``k`` with parameters name → value."""
        f = self._functions
        if not self.solid:
            raise EnergyFileError(
                f"{self.path}:{self.line}: {self.name} is a skin's energy (psi_surface alone); "
                "give it to body.skin, or define psi(k, ...) for a solid."
            )
        if "psi" in f:
            return f["psi"](k, **self.arguments("psi", values))
        return f["psi_dev"](k, **self.arguments("psi_dev", values)) + self.psi_vol(k.J, values).U

    def psi_dev(self, k: Any, values: dict[str, Any]) -> Any:
        """The isochoric part of a law that gives its parts, Pa.

        Raises:
            EnergyFileError: the law gives its energy as a whole.
        """
        if not self.is_split:
            raise EnergyFileError(
                f"{self.path}:{self.line}: {self.name} gives psi as a whole; a mixed or "
                "mean-dilatation formulation needs psi_dev(k, ...) and psi_vol(J, ...)."
            )
        return self._functions["psi_dev"](k, **self.arguments("psi_dev", values))

    @property
    def is_split(self) -> bool:
        """Whether the law gives psi_dev and psi_vol, as nearly incompressible ones do."""
        return {"psi_dev", "psi_vol"} <= set(self._functions)

    def psi_mixed(self, k: Any, p: Any, values: dict[str, Any]) -> Any:
        """psi_dev + p g(J) - U*(p), Pa; Mazier 2022, eqs. 38 and 41."""
        volumetric = self.psi_vol(k.J, values)
        return self.psi_dev(k, values) + p * volumetric.g - volumetric.conjugate(p)

    def psi_vol(self, J: Any, values: dict[str, Any]) -> energy.Volumetric:
        """The volumetric part of a nearly incompressible law."""
        volumetric = self._functions["psi_vol"](J, **self.arguments("psi_vol", values))
        if not isinstance(volumetric, energy.Volumetric):
            raise EnergyFileError(
                f"{self.path}:{self.line}: psi_vol must return a Volumetric, "
                f"got {type(volumetric).__name__}; "
                "use log_volumetric(J, bulk) or another helper of supple.energy."
            )
        return volumetric

    def psi_incompressible(self, k: Any, values: dict[str, Any]) -> Any:
        """ψ at J = 1: what a membrane that keeps its volume stores, Pa."""
        f = self._functions
        for name in ("psi_surface", "psi_dev", "psi"):
            if name in f:
                return f[name](k, **self.arguments(name, values))
        raise AssertionError("read() demands psi, psi_dev or psi_surface")
