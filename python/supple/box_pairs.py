"""Broad phase: which axis-aligned boxes of two sets meet, by sorting them into equal bins."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: Bins along the longest axis at most, so that one huge box among tiny ones stays affordable.
_MOST_BINS = 256


def meeting(low_a: Floats, high_a: Floats, low_b: Floats, high_b: Floats) -> tuple[Ints, Ints]:
    """Rows (k,) of a and (k,) of b whose boxes share a point; each pair once.

    Args:
        low_a, high_a: (a, dim) corners of the first boxes; low_b, high_b: (b, dim) of the others.

    Cost: O((a + b) log b + pairs of neighbours) for boxes of about one size.
    """
    origin, top = low_b.min(axis=0), high_b.max(axis=0)
    extent = float(np.mean((high_b - low_b).max(axis=1)))
    width = max(extent, float((top - origin).max()) / _MOST_BINS) or 1.0
    most = _bin(top, origin, width)
    kept = np.flatnonzero(((high_a >= origin) & (low_a <= top)).all(axis=1))
    first_a, first_b = (np.clip(_bin(x, origin, width), 0, most) for x in (low_a[kept], low_b))
    last_a, last_b = (np.clip(_bin(x, origin, width), 0, most) for x in (high_a[kept], high_b))
    (rows_a, keys_a), (rows_b, keys_b) = _bins(first_a, last_a, most), _bins(first_b, last_b, most)
    i, j = _joined(keys_a, keys_b)
    a, b = rows_a[i], rows_b[j]
    once = _number(np.maximum(first_a[a], first_b[b]), most) == keys_a[i]  # their first common bin
    a, b = kept[a[once]], b[once]
    met = ((low_a[a] <= high_b[b]) & (low_b[b] <= high_a[a])).all(axis=1)
    return a[met], b[met]


def _bin(places: Floats, origin: Floats, width: float) -> Ints:
    return np.asarray(np.floor((places - origin) / width).astype(np.int64))


def _number(bins: Ints, most: Ints) -> Ints:
    """One number (k,) for each bin (k, dim)."""
    return np.asarray(np.ravel_multi_index(tuple(bins.T), tuple((most + 1).tolist())))


def _bins(first: Ints, last: Ints, most: Ints) -> tuple[Ints, Ints]:
    """Row and bin number of every bin from ``first`` to ``last`` (n, dim)."""
    rows, bins = np.arange(len(first)), first
    for axis in range(first.shape[1]):
        count = (last - first)[rows, axis] + 1
        step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        rows, bins = np.repeat(rows, count), np.repeat(bins, count, axis=0)
        bins[:, axis] += step
    return rows, _number(bins, most)


def _joined(a: Ints, b: Ints) -> tuple[Ints, Ints]:
    """Rows of a and of b that hold the same number, all pairs."""
    order = np.argsort(b, kind="stable")
    left, right = (np.searchsorted(b[order], a, side) for side in ("left", "right"))
    count = right - left
    rows = np.repeat(np.arange(len(a)), count)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return rows, order[left[rows] + step]
