"""What FFCx makes of a term's forms before it writes C: its intermediate representation."""

from __future__ import annotations

from typing import Any

import numpy as np
from ffcx.analysis import analyze_ufl_objects
from ffcx.ir.representation import compute_ir
from ffcx.options import FFCX_DEFAULT_OPTIONS

from .forms.common import Forms

#: FFCx's own defaults and nothing from its option files: the folder one stands in changes nothing.
OPTIONS: dict[str, Any] = {name: value[1] for name, value in FFCX_DEFAULT_OPTIONS.items()}
#: What is represented of a solid's law alone.
LAW = "law_alone"


class Analysed:
    """Forms, and FFCx's representation of each of their kernels and parts, made once each."""

    def __init__(self, forms: Forms) -> None:
        self.forms = forms
        self._items = {**forms.kernels, **forms.parts}
        if forms.law:
            self._items[LAW] = (forms.law.values, np.zeros((1, 3)))
        self._made: dict[tuple[str, bool], tuple[Any, Any]] = {}

    def representation(self, name: str, tangent: Any = None) -> tuple[Any, Any]:
        """What FFCx compiles of a kernel, a form or values, and what it makes of that."""
        key = name, tangent is None
        if key not in self._made:
            item = (tangent.stand_in, tangent.points) if tangent else self._items[name]
            analysis = analyze_ufl_objects([item], OPTIONS["scalar_type"])
            if tangent:
                ((_, points, item_of),) = analysis.expressions
                analysis = analysis._replace(expressions=[(tangent.values, points, item_of)])
            self._made[key] = item, compute_ir(analysis, {}, name, dict(OPTIONS), False)
        return self._made[key]
