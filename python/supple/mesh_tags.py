"""Named parts of a mesh, and what a user may write to choose nodes or cells."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from supple.errors import InputError, MeshError

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Kind = Literal["points", "cells", "facets"]

#: callable(points (n, 3) m) -> mask (n,) | node ids | mask (n,) | tag name
Where = Callable[[Floats], npt.ArrayLike] | npt.ArrayLike | str
#: ids | mask (c,) | tag name
CellWhere = npt.ArrayLike | str


@dataclass(frozen=True, eq=False)
class Tag:
    """A named part of a mesh.

    Attributes:
        kind: "points", "cells" or "facets".
        ids: (k,) node or cell ids, sorted; for facets (k, nodes per facet) node ids, VTK order.
    """

    kind: Kind
    ids: Ints

    def __post_init__(self) -> None:
        if self.kind not in ("points", "cells", "facets"):
            raise MeshError(f"kind of a tag must be points, cells or facets, got {self.kind!r}.")


def find_tag(tags: Mapping[str, Tag], name: str) -> Tag:
    """The tag of that name; MeshError with the nearest name otherwise."""
    if name in tags:
        return tags[name]
    near = get_close_matches(name, tags, n=1, cutoff=0.4)
    have = f"did you mean {near[0]!r}? It has" if near else "it has"
    names = ", ".join(repr(t) for t in tags) or "none"
    raise MeshError(f"the mesh has no tag {name!r}; {have} {names}.")


def chosen(where: Any, count: int, what: str) -> Ints:
    """Sorted unique ids (k,) from a mask (count,) or ids; InputError if neither, or empty."""
    raw = np.asarray(where)
    if raw.dtype == np.bool_:
        if raw.shape != (count,):
            raise InputError(f"a mask of {what} must have shape ({count},), got {raw.shape}.")
        ids = np.flatnonzero(raw)
    else:
        ids = _ids(np.atleast_1d(raw), count, what)
    if not len(ids):
        raise InputError(f"no {what} chosen: `where` must name at least one of {count}.")
    return ids.astype(np.int64)


def _ids(raw: npt.NDArray[Any], count: int, what: str) -> npt.NDArray[Any]:
    """Sorted unique ids from an array that claims to be ids."""
    if raw.ndim != 1 or (raw.size and raw.dtype.kind not in "iu"):
        raise InputError(
            f"`where` must be a tag, a mask or integer ids of {what}, "
            f"got an array of {raw.dtype} with shape {raw.shape}."
        )
    ids = np.unique(raw)
    if len(ids) and (ids[0] < 0 or ids[-1] >= count):
        bad = ids[0] if ids[0] < 0 else ids[-1]
        raise InputError(f"`where` names {what} {bad}, outside 0 to {count - 1}.")
    return ids
