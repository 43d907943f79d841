"""Names that `Body.solve` and `Body.rest_shape` offer; imports nothing, for commands to list."""

#: Fixed points of forward solves.
FIXED_POINTS = ("sellier", "sellier-aitken", "sellier-anderson")
METHODS = ("inverse", "reversed-gravity", *FIXED_POINTS)
#: Of the symmetric tangents of `Body.solve`.
SYMMETRIC_SOLVERS = ("auto", "direct", "cg", "multigrid", "pardiso")
#: Of the inverse's unsymmetric tangents.
SOLVERS = ("auto", "gmres", "direct")
#: That a density counts in, that directions are those of.
STATES = ("rest", "loaded")
