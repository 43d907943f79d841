"""FElupe on the benchmark cantilever, one JSON line a request (see cantilever.py).

The request names a .npz with the mesh (points, cells in VTK's order, nodes held, nodal loads).
Mesh, region, field and solid body are there before the clock starts. Assembly is FElupe's own, with
its einsum in threads; the free part of the matrix is taken for the solver: MKL's Pardiso where
pypardiso is installed, else SciPy's SuperLU on the symmetric pattern.
"""

import time

import cantilever
import felupe
import numpy as np
import scipy.sparse.linalg

try:
    import pypardiso
except ImportError:
    pypardiso = None

REGIONS = {
    "P1": ("tetra", felupe.RegionTetra),
    "P2": ("tetra10", felupe.RegionQuadraticTetra),
    "Q1": ("hexahedron", felupe.RegionHexahedron),
    "Q2": ("hexahedron20", felupe.RegionQuadraticHexahedron),
}


class Problem:
    """A solid body in FElupe's field, and the free dofs."""

    def __init__(self, element, mesh):
        self.case = dict(np.load(mesh))
        kind, region = REGIONS[element]
        grid = felupe.Mesh(self.case["points"], self.case["cells"], kind)
        self.field = felupe.FieldContainer([felupe.Field(region(grid), dim=3)])
        free = np.ones(self.case["points"].shape, bool)
        free[self.case["held"]] = False
        self.free = np.flatnonzero(free)
        self.load = self.case["load"].ravel()[self.free]

    def solid(self, second):
        """The body with the first or the second parameters."""
        mu, lmbda = cantilever.lame(*cantilever.parameters(second))
        law = felupe.NeoHookeCompressible(mu=mu, lmbda=lmbda, parallel=True)
        return felupe.SolidBody(law, self.field)

    def residual(self, solid):
        """Internal minus external forces of the free dofs."""
        return solid.assemble.vector(self.field, parallel=True).toarray().ravel()[self.free] - (
            self.load
        )


def linear(matrix, right, kept):
    """Seconds of factorisation and solution, and the solution."""
    begin = time.perf_counter()
    if pypardiso is None:
        factor = scipy.sparse.linalg.splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )  # fmt: skip
        apply = factor.solve
    else:
        kept.factorize(matrix)
        apply = lambda b: kept.solve(matrix, b)  # noqa: E731
    factored = time.perf_counter()
    x = apply(right)
    return factored - begin, time.perf_counter() - factored, x


def newton(problem, solid, kept):
    """Newton from zero: seconds by phase, iterations, tip."""
    phases = {"assembly": 0.0, "factor": 0.0, "solve": 0.0}
    u = np.zeros(problem.case["points"].size)
    problem.field[0].values[:] = 0
    residual = problem.residual(solid)
    first = norm = np.linalg.norm(residual)
    iterations = 0
    while norm > cantilever.TOLERANCE * first and iterations < cantilever.MOST:
        begin = time.perf_counter()
        matrix = solid.assemble.matrix(problem.field, parallel=True).tocsr()
        matrix = matrix[problem.free][:, problem.free]
        matrix.sort_indices()
        phases["assembly"] += time.perf_counter() - begin
        factor, solve, step = linear(matrix, -residual, kept)
        phases["factor"] += factor
        phases["solve"] += solve
        u[problem.free] += step
        problem.field[0].values[:] = u.reshape(-1, 3)
        residual = problem.residual(solid)
        norm = np.linalg.norm(residual)
        iterations += 1
    found = cantilever.tip(problem.case["points"], u.reshape(-1, 3)).tolist()
    return phases | {"iterations": iterations, "residual": norm / first, "tip": found}


def timed(problem, kept, second):
    """One solve with the clocks around all of it."""
    solid = problem.solid(second)
    begin, cpu = time.perf_counter(), time.process_time()
    result = newton(problem, solid, kept)
    spent = {"total": time.perf_counter() - begin, "cpu": time.process_time() - cpu}
    return result | spent


def solve(element, law, mesh, second, **_):
    """First and, if asked, second solve; neo-Hookean alone, other laws wait for its AD."""
    if law != "neo_hookean":
        return {}
    kept = None if pypardiso is None else pypardiso.PyPardisoSolver(mtype=11)
    problem = Problem(element, mesh)
    answer = timed(problem, kept, False)
    if second:
        answer["second"] = timed(problem, kept, True)
    note = "SuperLU" if pypardiso is None else "MKL Pardiso"
    return answer | {"dofs": problem.case["points"].size, "note": note}


if __name__ == "__main__":
    cantilever.serve(solve)
