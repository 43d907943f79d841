"""The words of an energy file; see `supple.kernels.energy`, which this repeats for imports."""

from __future__ import annotations

from .kernels.energy import *  # noqa: F403
from .kernels.energy import __all__ as __all__
