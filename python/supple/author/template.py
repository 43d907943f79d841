"""A first energy file, to be changed."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError

TEMPLATE = '''"""NAME: a nearly incompressible Yeoh solid; write here its formula and source.

psi_dev = c1 (I1_bar - 3) + c2 (I1_bar - 3)²,  psi_vol = bulk/2 ln(J)².  Yeoh (1990).
"""

from supple.energy import Kinematics, Pa, log_volumetric

# Each parameter has a type (its unit and bounds), a default, and may differ from cell to cell:
#   Pa (above 0), Pa(minimum=0.0), Ratio (Poisson's), Number, Metre, Direction (a fibre).
# k offers F, C, B, E, J, I1, I2, I3, I1_bar, I2_bar, k.I4(fibre), k.I8(fibre, sheet), U, trace_U;
# supple.energy offers exp, ln, sqrt, tr, inner, dot, positive and more. No derivative is needed.


def psi_dev(k: Kinematics, c1: Pa = 500.0, c2: Pa(minimum=0.0) = 100.0):
    strain = k.I1_bar - 3
    return c1 * strain + c2 * strain**2


def psi_vol(J, bulk: Pa = 1e5):
    return log_volumetric(J, bulk)
'''


def write(file: Path) -> Path:
    """Write the template to a file that does not exist yet.

    Raises:
        InputError: it exists, its name cannot be that of an energy, or it cannot be written.
    """
    if file.suffix != ".py" or not file.stem.isidentifier():
        raise InputError(
            f"FILE must be named like a Python module, such as my_law.py, got {file.name}."
        )
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(TEMPLATE.replace("NAME", file.stem.replace("_", " ").capitalize()))
    except FileExistsError:
        raise InputError(f"{file} exists already; choose another name.") from None
    except OSError as problem:
        raise InputError(f"{file} cannot be written ({problem.strerror}).") from None
    return file
