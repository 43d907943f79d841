"""Long edges of half a body divided, and the new vertices where the surface bends least."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from supple.core import core
from supple.registration.makehuman_cut import Half

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Edge = tuple[int, int]


def refined(half: Half, points: Floats, fuller: Floats, mirror: Ints, longest: Floats) -> Half:
    """Edges longer than the mean ``longest`` (h,) m of their ends divided once, conformingly.

    ``points`` (n, 3) m and ``mirror`` (n,) are those of all the mesh; an edge is as long as it is
    there or in the ``fuller`` shape (n, 3) m, whichever is more. The old vertices stay; the new
    ones minimise the thin-plate energy |M^-1/2 L x|² with the cotangent Laplacian L, so that
    their positions, and all else at them, stay linear in the values of the mesh.
    """
    at = half.means @ points
    split = _long(half.triangles, (at, half.means @ fuller), longest)
    if not split:
        return half
    ends = np.array(list(split))
    triangles = _divided(half.triangles, split, at)
    middle = np.concatenate([half.middle, half.middle[ends].all(axis=1)])
    means, whole, image = Half(_halved(half.means, ends), triangles, middle).whole(mirror)
    new = np.arange(len(at), len(middle))
    free = np.setdiff1d(np.union1d(new, image[new]), _rim(whole))
    means = _faired(means, whole, means @ points, free)
    return Half(means[: len(middle)], triangles, middle)


def _long(triangles: Ints, shapes: tuple[Floats, ...], longest: Floats) -> dict[Edge, int]:
    """Which edges to divide, and the numbers of the vertices on them."""
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.max([np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in shapes], 0)
    chosen = edges[length > longest[edges].mean(axis=1)].tolist()
    return {(a, b): len(longest) + k for k, (a, b) in enumerate(chosen)}


def _divided(triangles: Ints, split: dict[Edge, int], at: Floats) -> Ints:
    """Each triangle in two, three or four, as many of its edges are divided."""
    where = np.vstack([at, [(at[a] + at[b]) / 2 for a, b in split]])
    result: list[tuple[int, ...]] = []
    for triangle in triangles.tolist():
        on = [split.get((min(a, b), max(a, b)), -1)
              for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True)]  # fmt: skip
        result += _parts(triangle, on, where)
    return np.array(result, dtype=np.int64)


def _parts(triangle: list[int], on: list[int], at: Floats) -> list[tuple[int, ...]]:
    count = sum(k >= 0 for k in on)
    if count in (0, 3):
        (a, b, c), (p, q, r) = triangle, on
        return [(a, p, r), (p, b, q), (r, q, c), (p, q, r)] if count else [(a, b, c)]
    turn = next(i for i in range(3) if on[i] >= 0 and (count == 1 or on[i - 2] >= 0))
    a, b, c = (triangle[(turn + i) % 3] for i in range(3))
    p, q = on[turn], on[(turn + 1) % 3]
    if count == 1:
        return [(a, p, c), (p, b, c)]
    shorter = np.linalg.norm(at[a] - at[q]) < np.linalg.norm(at[p] - at[c])
    return [(p, b, q), *([(a, p, q), (a, q, c)] if shorter else [(a, p, c), (p, q, c)])]


def _halved(means: Any, ends: Ints) -> Any:
    from scipy import sparse

    return sparse.vstack([means, 0.5 * (means[ends[:, 0]] + means[ends[:, 1]])]).tocsr()


def _rim(triangles: Ints) -> Ints:
    """Vertices on edges of one triangle only."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    return np.unique(unique[count == 1])


def _faired(means: Any, triangles: Ints, at: Floats, free: Ints) -> Any:
    """``means`` with its rows ``free`` where (M^-1 L)ᵀ M (M^-1 L) x = 0, all other rows held."""
    from scipy import sparse

    stiffness, mass = laplacian(at, triangles)
    bending = (stiffness.T @ sparse.diags_array(1 / mass) @ stiffness).tocsr()
    held = np.setdiff1d(np.arange(len(at)), free)
    force = -(bending[free][:, held] @ means[held]).tocsc()
    columns = np.flatnonzero(np.diff(force.indptr))
    solved = _solved(bending[free][:, free].toarray(), force[:, columns].toarray())
    solved[np.abs(solved) < 1e-6] = 0
    solved /= solved.sum(axis=1, keepdims=True)
    rows, used = np.nonzero(solved)
    fair = sparse.csr_array((solved[rows, used], (free[rows], columns[used])), shape=means.shape)
    keep = np.ones(len(at))
    keep[free] = 0
    return (sparse.diags_array(keep) @ means + fair).tocsr()


def laplacian(at: Floats, triangles: Ints) -> tuple[Any, Floats]:
    """Cotangent stiffness (n, n) CSR and lumped areas (n,) m² of a surface.

    Source: Meyer et al. (2003), Discrete differential-geometry operators, §3.
    """
    from scipy import sparse

    n = len(at)
    stiffness = sparse.csr_array((n, n))
    double = np.linalg.norm(
        np.cross(at[triangles[:, 1]] - at[triangles[:, 0]],
                 at[triangles[:, 2]] - at[triangles[:, 0]]), axis=1)  # fmt: skip
    for i in range(3):
        o, a, b = triangles[:, i], triangles[:, (i + 1) % 3], triangles[:, (i + 2) % 3]
        cotangent = np.einsum("td,td->t", at[a] - at[o], at[b] - at[o]) / double / 2
        half = sparse.coo_array((cotangent, (a, b)), shape=(n, n)).tocsr()
        stiffness = stiffness - half - half.T
    stiffness = stiffness - sparse.diags_array(np.asarray(stiffness.sum(axis=1)).ravel())
    mass = np.bincount(triangles.ravel(), np.repeat(double / 6, 3), minlength=n)
    return stiffness.tocsr(), np.asarray(mass, dtype=np.float64)


def _solved(matrix: Floats, right: Floats) -> Floats:
    """x (n, k) of A x = b, A symmetric positive definite: A⁻¹ b.

    By the core and a plain sum: bits of a BLAS change with the number of its threads, and the
    template with them.
    """
    inverse = core().inverse_sum(matrix, np.zeros_like(matrix))
    x = np.einsum("ij,jk->ik", inverse, right)
    missing = right - np.einsum("ij,jk->ik", matrix, x)
    return np.asarray(x + np.einsum("ij,jk->ik", inverse, missing))
