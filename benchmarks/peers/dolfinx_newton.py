"""DOLFINx with MUMPS on the benchmark cantilever, one JSON line a request (see cantilever.py).

Mesh, space and compiled forms are there before the clock starts; the sparse matrix, MUMPS' analysis
and Newton count. Assembly is DOLFINx' own, with its default flags: `assemble_matrix` into the
PETSc matrix with the supports' rows and columns left out, until `Mat.assemble` is done. The second
solve keeps matrix and analysis.
Run by mpirun, rank 0 reads the requests. A rank is one thread: team.py sets OMP_NUM_THREADS.
"""

import time

from mpi4py import MPI  # first: it finds the library that DOLFINx is linked to

# isort: split
import basix.ufl
import cantilever
import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from petsc4py import PETSc

WORLD = MPI.COMM_WORLD


class Problem:
    """Forms, supports and the vectors of one case."""

    def __init__(self, element, law, divisions):
        tetra = element[0] == "P"
        cell = dolfinx.mesh.CellType.tetrahedron if tetra else dolfinx.mesh.CellType.hexahedron
        ends = [[0.0, 0.0, 0.0], [cantilever.LENGTH, cantilever.WIDTH, cantilever.WIDTH]]
        self.mesh = dolfinx.mesh.create_box(WORLD, ends, divisions, cell)
        family = "Serendipity" if element == "Q2" else "P"
        made = basix.ufl.element(family, self.mesh.basix_cell(), int(element[1]), shape=(3,))
        self.space = fem.functionspace(self.mesh, made)
        self.u = fem.Function(self.space)
        self.mu, self.lmbda = (fem.Constant(self.mesh, 0.0) for _ in range(2))
        self.residual, self.tangent = self.forms(law, cantilever.DEGREES[element])
        self.clamp = self.support()

    def facets(self, x):
        """Boundary facets at x."""
        return dolfinx.mesh.locate_entities_boundary(
            self.mesh, 2, lambda points: np.isclose(points[0], x)
        )

    def support(self):
        """No displacement at x = 0."""
        dofs = fem.locate_dofs_topological(self.space, 2, self.facets(0.0))
        return fem.dirichletbc(fem.Function(self.space), dofs)

    def forms(self, law, degree):
        """R and K, compiled."""
        v, du = ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        F = ufl.variable(ufl.Identity(3) + ufl.grad(self.u))
        psi = {"neo_hookean": neo_hookean, "saint_venant_kirchhoff": saint_venant_kirchhoff}[law]
        P = ufl.diff(psi(F, self.mu, self.lmbda), F)
        loaded = np.sort(self.facets(cantilever.LENGTH))
        tags = dolfinx.mesh.meshtags(self.mesh, 2, loaded, np.ones(len(loaded), np.int32))
        dx = ufl.Measure("dx", self.mesh, metadata={"quadrature_degree": degree})
        ds = ufl.Measure("ds", subdomain_data=tags)
        traction = fem.Constant(self.mesh, np.array([0.0, cantilever.TRACTION, 0.0]))
        residual = ufl.inner(P, ufl.grad(v)) * dx - ufl.inner(traction, v) * ds(1)
        return fem.form(residual), fem.form(ufl.derivative(residual, self.u, du))

    def assemble_residual(self, b):
        """R into b, 0 at the support; its norm."""
        with b.localForm() as local:
            local.set(0)
        petsc.assemble_vector(b, self.residual)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        petsc.set_bc(b, [self.clamp], x0=self.u.x.petsc_vec, alpha=-1.0)
        b.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
        return b.norm()

    def tip(self):
        """Displacement of the loaded face's centre, on rank 0."""
        place = np.array([[cantilever.LENGTH, cantilever.WIDTH / 2, cantilever.WIDTH / 2]])
        tree = dolfinx.geometry.bb_tree(self.mesh, 3, padding=1e-10)
        near = dolfinx.geometry.compute_collisions_points(tree, place)
        cells = dolfinx.geometry.compute_colliding_cells(self.mesh, near, place).links(0)
        mine = self.u.eval(place, cells[:1]).ravel().tolist() if len(cells) else None
        return next((t for t in WORLD.allgather(mine) if t is not None), None)


def neo_hookean(F, mu, lmbda):
    J = ufl.det(F)
    return mu / 2 * (ufl.tr(F.T * F) - 3) - mu * ufl.ln(J) + lmbda / 2 * ufl.ln(J) ** 2


def saint_venant_kirchhoff(F, mu, lmbda):
    E = (F.T * F - ufl.Identity(3)) / 2
    return lmbda / 2 * ufl.tr(E) ** 2 + mu * ufl.inner(E, E)


class Linear:
    """The matrix, its vectors and its factor."""

    def __init__(self, problem, factor):
        self.A = petsc.create_matrix(problem.tangent)
        self.b, self.x = petsc.create_vector(problem.space), self.A.createVecRight()
        if factor != "lu":
            self.A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
            self.A.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, True)
            self.A.setOption(PETSc.Mat.Option.SPD, factor == "llt")
        self.ksp = PETSc.KSP().create(WORLD)
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("lu" if factor == "lu" else "cholesky")
        self.ksp.getPC().setFactorSolverType("mumps")
        self.ksp.setOperators(self.A)


def newton(problem, linear, second):
    """Newton from zero: seconds by phase, iterations, tip."""
    phases = {"assembly": 0.0, "factor": 0.0, "solve": 0.0}
    mu, lmbda = cantilever.lame(*cantilever.parameters(second))
    problem.mu.value, problem.lmbda.value = mu, lmbda
    problem.u.x.array[:] = 0
    first = norm = problem.assemble_residual(linear.b)
    iterations = 0
    while norm > cantilever.TOLERANCE * first and iterations < cantilever.MOST:
        begin = time.perf_counter()
        linear.A.zeroEntries()
        petsc.assemble_matrix(linear.A, problem.tangent, [problem.clamp])
        linear.A.assemble()
        assembled = time.perf_counter()
        linear.ksp.setOperators(linear.A)
        linear.ksp.setUp()
        factored = time.perf_counter()
        linear.ksp.solve(linear.b, linear.x)
        end = time.perf_counter()
        problem.u.x.petsc_vec.axpy(-1, linear.x)
        problem.u.x.scatter_forward()
        norm = problem.assemble_residual(linear.b)
        times = (assembled - begin, factored - assembled, end - factored)
        phases = {k: v + t for (k, v), t in zip(phases.items(), times, strict=True)}
        iterations += 1
    return phases | {"iterations": iterations, "residual": norm / first}


def timed(problem, factor, kept, second):
    """One solve, with the clocks around all of it."""
    WORLD.barrier()
    begin, cpu = time.perf_counter(), time.process_time()
    linear = kept or Linear(problem, factor)
    result = newton(problem, linear, second)
    spent = {"total": time.perf_counter() - begin, "cpu": time.process_time() - cpu}
    return result | spent | {"tip": problem.tip()}, linear


def solve(element, law, divisions, second, factor="lu", **_):
    """First and, if asked, second solve."""
    problem = Problem(element, law, divisions)
    first, linear = timed(problem, factor, None, False)
    if second:
        first["second"], _ = timed(problem, factor, linear, True)
    linear.ksp.destroy()
    blocks = problem.space.dofmap
    dofs = blocks.index_map.size_global * blocks.index_map_bs
    return first | {"dofs": dofs}


def follow():
    """Ranks behind the first: wait for its requests without a busy loop."""
    while True:
        while not WORLD.iprobe(source=0):
            time.sleep(0.001)
        request = WORLD.recv(source=0)
        if request is None:
            return
        solve(**request)


def lead(**request):
    """Rank 0: tell the others, then solve."""
    for rank in range(1, WORLD.size):
        WORLD.send(request, dest=rank)
    return solve(**request)


if __name__ == "__main__":
    if WORLD.rank:
        follow()
    else:
        cantilever.serve(lead)
        for other in range(1, WORLD.size):
            WORLD.send(None, dest=other)
