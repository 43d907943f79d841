"""The bodies that the benchmarks solve."""

from __future__ import annotations

from peers.cantilever import LENGTH, TRACTION, WIDTH, parameters

import supple


def cantilever(
    element: str, cells: tuple[int, int, int], law: str = "neo_hookean", mixed: bool = False
) -> supple.Body:
    """Clamped at x = 0, (0, -10, 0) Pa on x = 80."""
    mesh = supple.Mesh.box(cells, (LENGTH, WIDTH, WIDTH), element)
    young, poisson = parameters()
    if mixed:
        body = incompressible(mesh, young, 0.0)
    else:
        body = supple.Body(mesh, law, young=young, poisson=poisson)
    return body.fix(lambda x: x[:, 0] < 1e-9).traction(
        lambda x: x[:, 0] > LENGTH - 1e-9, (0.0, TRACTION, 0.0)
    )


def block(cells: int, element: str = "P1", mixed: bool = False) -> supple.Body:
    """A cube of 0.1 m and 1 kPa on its base z = 0; gravity draws it upwards and sideways."""
    mesh = supple.Mesh.box((cells,) * 3, (0.1,) * 3, element)
    if mixed:
        body = incompressible(mesh, 1e3, 1e3)
    else:
        body = supple.Body(mesh, "neo_hookean", density=1e3, young=1e3, poisson=0.3)
    return body.fix(lambda x: x[:, 2] < 1e-9).gravity((0.0, 0.5, 1.0))


def incompressible(mesh: supple.Mesh, young: float, density: float) -> supple.Body:
    """Nearly: neo-Hookean and mixed, with a bulk modulus of a hundred shear moduli."""
    values = {"mu": young / 3, "bulk": 100 * young / 3}
    return supple.Body(mesh, "neo_hookean_isochoric", "mixed", density=density, **values)
