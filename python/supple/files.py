"""What every reader and writer needs: units of length, files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from supple.errors import InputError

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

#: Metres in one unit of length.
METRES = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}


def metres(unit: str) -> float:
    """Metres in one ``unit``; InputError for a unit that is not known."""
    if unit not in METRES:
        near = get_close_matches(str(unit), METRES, n=1, cutoff=0.3)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise InputError(f"unit must be one of {', '.join(METRES)}, got {unit!r}{hint}")
    return METRES[unit]


def existing(path: Path) -> Path:
    """The same path; InputError if no file is there, but a folder or nothing, or an empty one."""
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a file; name the file in it.")
    if not path.is_file():
        raise InputError(f"no file at {path}; check the path.")
    if path.stat().st_size == 0:
        raise InputError(f"the file {path} is empty; export it again.")
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A file beside ``path`` to write; it takes ``path``'s place when the block ends well."""
    if not path.parent.is_dir():
        raise InputError(f"no folder {path.parent} to write {path.name} in; create it first.")
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    aside = Path(name)
    try:
        yield aside
        aside.chmod(0o666 & ~_umask())
        os.replace(aside, path)
    finally:
        aside.unlink(missing_ok=True)


def _umask() -> int:
    """The process' file mode mask, which can only be read by setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def parsed_xml(text: str | bytes, source: object) -> Element:
    """The root of an XML text that declares no entities, so it neither loads nor inflates anything.

    Raises:
        InputError: no XML, or one that declares entities.
    """
    from xml.etree import ElementTree

    data = text.encode() if isinstance(text, str) else text
    if b"<!ENTITY" in data.replace(b"\x00", b""):
        raise InputError(f"{source} declares XML entities, which no scan needs; export it again.")
    try:
        return ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise InputError(
            f"{source} is no XML that can be read ({error}); export it again."
        ) from None
