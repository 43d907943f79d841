"""An energy file as its author wrote it: docstring, functions, typed parameters in words."""

from __future__ import annotations

import ast
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..kernels.law import Parameter


def docstring(file: Path) -> str:
    """All of its docstring: formula and source."""
    return ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""


def functions(file: Path) -> str:
    """The source of its functions, as written."""
    text = file.read_text(encoding="utf-8")
    found = [n for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)]
    return "\n\n".join(ast.get_source_segment(text, f) or "" for f in found)


def parameter_line(p: Parameter) -> str:
    """``young = 3000 Pa, above 0``."""
    value = number(p.default) if np.ndim(p.default) == 0 else _vector(p.default)
    unit = "" if p.unit == "1" else f" {p.unit}"
    bounds = bounds_in_words(p)
    return f"{p.name} = {value}{unit}{', ' + bounds if bounds else ''}"


def bounds_in_words(p: Parameter) -> str:
    """Such as "above 0" or "from 0 to 0.5"; "" where there are none."""
    if p.kind.size > 1:
        return "a direction"
    low, high = math.isfinite(p.kind.minimum), math.isfinite(p.kind.maximum)
    if low and high:
        words = ("between", "and") if p.kind.open else ("from", "to")
        return f"{words[0]} {number(p.kind.minimum)} {words[1]} {number(p.kind.maximum)}"
    if low:
        return f"{'above' if p.kind.open else 'at least'} {number(p.kind.minimum)}"
    if high:
        return f"{'below' if p.kind.open else 'at most'} {number(p.kind.maximum)}"
    return ""


def number(value: float) -> str:
    """A plain number, six digits."""
    return f"{value:.6g}"


def _vector(value: object) -> str:
    return "(" + ", ".join(number(float(v)) for v in np.ravel(np.asarray(value))) + ")"
