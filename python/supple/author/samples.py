"""The deformations that a law is tried on: five curves, and random ones between their ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import InputError
from .modes import Mode

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Range:
    """How far a law is deformed.

    Attributes:
        stretch: least and largest stretch, below and above 1.
        shear: largest amount of simple shear, both ways.
        volume: least and largest volume ratio J.
        points: of each curve, at least 11.
        samples: number of random deformations.
        seed: of those.
    """

    stretch: tuple[float, float] = (0.4, 2.0)
    shear: float = 1.0
    volume: tuple[float, float] = (0.5, 1.5)
    points: int = 61
    samples: int = 64
    seed: int = 0

    def __post_init__(self) -> None:
        for name, (low, high) in (("stretch", self.stretch), ("volume", self.volume)):
            if not 0 < low < 1 < high < np.inf:
                raise InputError(f"{name} must go from below 1 to above 1, got {low:g} {high:g}.")
        if not 0 < self.shear < np.inf:
            raise InputError(f"shear must be above 0, got {self.shear:g}.")
        if self.points < 11 or self.samples < 1:
            raise InputError("a curve needs at least 11 points, and there is at least one sample.")

    def values(self, mode: Mode) -> Floats:
        """Where a test's curve is computed (m,); its rest value is one of them."""
        low, high = {
            "stretch": self.stretch,
            "shear": (-self.shear, self.shear),
            "volume ratio": self.volume,
        }[mode.control]
        below = max(3, round(self.points * (mode.rest - low) / (high - low)))
        ends = (
            np.linspace(low, mode.rest, below),
            np.linspace(mode.rest, high, self.points - below + 1),
        )
        return np.concatenate([ends[0], ends[1][1:]])

    def deformations(self) -> Floats:
        """Random F (samples, 3, 3), det F within `volume`, no principal stretch far outside."""
        rng = np.random.default_rng(self.seed)
        low, high = np.log(self.stretch)
        logs = rng.uniform(low, high, (self.samples, 3)) / 1.5
        logs -= logs.mean(axis=1, keepdims=True)
        logs += np.log(rng.uniform(*self.volume, (self.samples, 1))) / 3
        left, right = rotations(rng, self.samples), rotations(rng, self.samples)
        turned: Floats = left * np.exp(logs)[:, None, :] @ right
        return turned


def rotations(rng: np.random.Generator, count: int) -> Floats:
    """Rotations (count, 3, 3), uniformly distributed; Mezzadri (2007), Notices AMS 54(5)."""
    q, r = np.linalg.qr(rng.standard_normal((count, 3, 3)))
    q = q * np.sign(np.diagonal(r, axis1=1, axis2=2))[:, None, :]
    turned: Floats = q * np.linalg.det(q)[:, None, None]
    return turned
