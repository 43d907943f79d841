"""fenicsx-pulse's two ways to a rest shape, timed; runs in its own environment for rest_peers.py.

CASE.npz (mesh, base, loaded facets, law, pressure) → set up, solve → RESULT.npz

python pulse_block.py inverse|fixed-point CASE.npz RESULT.npz
"""

import logging
import sys
import time

from mpi4py import MPI  # first: it finds the library that DOLFINx is linked to

# isort: split
import basix.ufl
import dolfinx
import numpy as np
import pulse
from pulse.unloading import FixedPointUnloader, PrestressProblem, TargetPressure

SIDE = 1
#: Full load at once: pulse ramps from 0, and two steps are 0 and 1.
RAMP = 2


def geometry(case):
    """The block as pulse wants it, and which of the case's points each of its nodes is."""
    element = basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,))
    mesh = dolfinx.mesh.create_mesh(MPI.COMM_SELF, case["cells"], element, case["points"])
    marker = pulse.Marker("SIDE", SIDE, 2, lambda x: np.isclose(x[0], case["points"][:, 0].max()))
    return pulse.Geometry(mesh=mesh, boundaries=[marker], metadata={"quadrature_degree": 1})


def model(case):
    """Uncoupled neo-Hookean with κ/4 (J² - 1 - 2 ln J), nothing active."""
    return pulse.CardiacModel(
        material=pulse.NeoHookean(mu=pulse.Variable(float(case["mu"]), "Pa")),
        active=pulse.active_model.Passive(),
        compressibility=pulse.compressibility.Compressible2(
            kappa=pulse.Variable(float(case["bulk"]), "Pa")
        ),
    )


def clamp(space):
    """The base z = 0 is held."""
    mesh = space.mesh
    facets = dolfinx.mesh.locate_entities_boundary(mesh, 2, lambda x: np.isclose(x[2], 0.0))
    dofs = dolfinx.fem.locate_dofs_topological(space, 2, facets)
    return [dolfinx.fem.dirichletbc(np.zeros(3), dofs, space)]


def run(method, case):
    """Displacement from the loaded shape to rest (n, 3), seconds of set-up and of solving."""
    where = geometry(case)
    pressure = pulse.Variable(dolfinx.fem.Constant(where.mesh, 0.0), "Pa")
    load = pulse.NeumannBC(traction=pressure, marker=SIDE)
    targets = [TargetPressure(traction=pressure, target=float(case["pressure"]))]
    bcs = pulse.BoundaryConditions(dirichlet=(clamp,), neumann=(load,))
    begin = time.perf_counter()
    if method == "inverse":
        problem = PrestressProblem(
            geometry=where, model=model(case), bcs=bcs, parameters={"u_space": "P_1"},
            targets=targets, ramp_steps=RAMP,
        )  # fmt: skip
    else:
        options = pulse.StaticProblem.default_parameters()["petsc_options"] | {"snes_atol": 1e-10}
        problem = FixedPointUnloader(
            geometry=where, model=model(case), bcs=bcs, targets=targets,
            problem_parameters={"u_space": "P_1", "petsc_options": options},
            unload_parameters={"ramp_steps": RAMP, "max_iter": 60, "tol": float(case["tolerance"])},
        )  # fmt: skip
    ready = time.perf_counter()
    u = problem.unload()
    end = time.perf_counter()
    rows = u.x.array.reshape(-1, 3)
    places = u.function_space.tabulate_dof_coordinates()
    return places, rows, ready - begin, end - ready


class Count(logging.Handler):
    """Counts the fixed point's iterations by what pulse logs."""

    iterations = 0

    def emit(self, record):
        self.iterations += record.getMessage().startswith("Unloading Iteration")


def main():
    """Read, run, write."""
    method, source, target = sys.argv[1:]
    count = Count()
    logger = logging.getLogger("pulse")
    logger.setLevel(logging.INFO)
    logger.addHandler(count)
    logger.propagate = False
    case = dict(np.load(source))
    places, u, setup, solve = run(method, case)
    nearest = np.array([np.abs(case["points"] - x).sum(axis=1).argmin() for x in places])
    ordered = np.empty_like(u)
    ordered[nearest] = u
    np.savez(target, u=ordered, setup=setup, solve=solve, iterations=count.iterations)


if __name__ == "__main__":
    main()
