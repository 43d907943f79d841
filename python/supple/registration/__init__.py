"""Bringing one surface onto another: rigid alignment of a scan with the model."""

from __future__ import annotations

from supple.registration.icp import AlignSettings
from supple.registration.rigid import Alignment, align, fit_rigid

__all__ = ["AlignSettings", "Alignment", "align", "fit_rigid"]
