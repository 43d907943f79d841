"""Meshes that others have published, from a folder that holds them under their usual names.

beam_pdms/Beam2k.msh    the silicone beam of Mazier et al. (2022), m
liver_sofa/liver.msh    SOFA's liver, without a unit
"""

from __future__ import annotations

from pathlib import Path

from ..mesh import Mesh


def beam2k(folder: Path) -> Mesh:
    """The beam of 182 mm as published, P1."""
    return Mesh.read(folder / "beam_pdms" / "Beam2k.msh", unit="m")


def liver(folder: Path) -> Mesh:
    """The liver at a width of 19 cm, P1."""
    mesh = Mesh.read(folder / "liver_sofa" / "liver.msh", unit="m")
    return Mesh(0.03 * mesh.points, mesh.cells, "P1")
