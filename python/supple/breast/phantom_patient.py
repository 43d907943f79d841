"""Who the synthetic patient is: everything that a seed decides before anything is solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from supple.breast.phantom_anatomy import Anatomy, Array, Dome, Torso


@dataclass(frozen=True)
class Tissues:
    """Elastic moduli, Pa, density, kg/m^3, and the skin's thickness, m.

    Attributes:
        fat, gland, tumour: Young's moduli at small strain.
        poisson: Poisson's ratio of all three.
        skin: Young's modulus of the skin, an incompressible membrane.
    """

    fat: float
    gland: float
    tumour: float
    skin: float
    poisson: float = 0.45
    density: float = 1000.0
    thickness: float = 2e-3


@dataclass(frozen=True)
class Misalignment:
    """The rigid motion from the image's frame to the scanner's: R x + t, metres.

    Attributes:
        rotation: R (3, 3), det R = +1.
        translation: t (3,) m.
        angle: of R, rad.
    """

    rotation: Array
    translation: Array
    angle: float

    def apply(self, points: Array) -> Array:
        """Points (..., 3) m of the image's frame in the scanner's."""
        return np.asarray(points @ self.rotation.T + self.translation)


@dataclass(frozen=True)
class Patient:
    """One synthetic patient at rest, her tumour's size, and where image and scanner put her.

    Attributes:
        tumour_side: breast with the tumour: -1 right, +1 left.
        tumour_radius: at rest, m.
        isocentre: (3,) m, added to the thorax's coordinates in the image's frame.
    """

    anatomy: Anatomy
    tissues: Tissues
    tumour_side: int
    tumour_radius: float
    isocentre: Array
    misalignment: Misalignment


def draw_patient(rng: np.random.Generator) -> Patient:
    """A patient from ``rng``: size, shape, stiffness, tumour and misalignment all vary."""
    return Patient(
        anatomy=_draw_anatomy(rng),
        tissues=_draw_tissues(rng),
        tumour_side=int(rng.choice([-1, 1])),
        tumour_radius=float(rng.uniform(4.5e-3, 7.5e-3)),
        isocentre=rng.uniform(-1.0, 1.0, 3) * np.array([0.02, 0.06, 0.06]),
        misalignment=_draw_misalignment(rng),
    )


def _draw_anatomy(rng: np.random.Generator) -> Anatomy:
    scale = rng.uniform(0.96, 1.04)
    torso = Torso(0.145 * scale, 0.105 * scale, rng.uniform(8e-3, 11e-3), rng.uniform(5e-3, 6e-3))
    common = {
        "azimuth": rng.uniform(0.64, 0.68),
        "radius": rng.uniform(64e-3, 70e-3) * scale,
        "projection": rng.uniform(54e-3, 62e-3) * scale,
        "fullness": rng.uniform(0.20, 0.30),
        "ptosis": rng.uniform(0.05, 0.30),
        "tilt": rng.uniform(0.25, 0.40),
    }
    domes = (_draw_dome(rng, torso, -1, common), _draw_dome(rng, torso, 1, common))
    waves = np.column_stack([rng.normal(0.0, 7.0, (6, 3)), rng.uniform(0.0, 2.0 * np.pi, 6)])
    return Anatomy(torso, domes, float(rng.uniform(0.45, 0.60)), waves)


def _draw_dome(rng: np.random.Generator, torso: Torso, side: int, common: dict[str, float]) -> Dome:
    """The breast of one side: nobody's two breasts are quite the same."""
    azimuth = common["azimuth"]
    metre = np.hypot(torso.half_width * np.cos(azimuth), torso.half_depth * np.sin(azimuth))
    return Dome(
        azimuth=side * azimuth,
        level=float(rng.uniform(-4e-3, 4e-3)),
        metre=float(metre),
        across=common["radius"] * rng.uniform(0.98, 1.02),
        along=common["radius"] * rng.uniform(0.96, 1.04),
        projection=common["projection"] * rng.uniform(0.97, 1.03),
        fullness=common["fullness"],
        ptosis=common["ptosis"],
        tilt=side * common["tilt"],
    )


def _draw_tissues(rng: np.random.Generator) -> Tissues:
    fat = float(rng.uniform(800.0, 1100.0))
    gland, tumour = fat * rng.uniform(1.0, 1.4), fat * rng.uniform(4.0, 8.0)
    return Tissues(fat, float(gland), float(tumour), float(rng.uniform(18e3, 27e3)))


def _draw_misalignment(rng: np.random.Generator) -> Misalignment:
    """A turn of 5 to 20 degrees about any axis and a shift of 30 to 100 mm in any direction."""
    axis, heading = rng.normal(size=3), rng.normal(size=3)
    angle = float(np.deg2rad(rng.uniform(5.0, 20.0)))
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    shift = rng.uniform(0.03, 0.10) * heading / np.linalg.norm(heading)
    return Misalignment(rotation, shift, angle)
