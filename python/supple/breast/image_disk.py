"""Whether a file holds what its header promises, before ITK reads it."""

from __future__ import annotations

import gzip
import math
import struct
import zlib
from pathlib import Path

from supple.errors import InputError

_GZIP = b"\x1f\x8b"
_SUFFIXES = (".nii", ".nii.gz", ".mha", ".mhd", ".nrrd", ".nhdr")
_META_BYTES = {
    "MET_CHAR": 1, "MET_UCHAR": 1, "MET_SHORT": 2, "MET_USHORT": 2, "MET_INT": 4, "MET_UINT": 4,
    "MET_LONG": 4, "MET_ULONG": 4, "MET_LONG_LONG": 8, "MET_ULONG_LONG": 8, "MET_FLOAT": 4,
    "MET_DOUBLE": 8,
}  # fmt: skip


def check_disk(name: str, path: Path) -> None:
    """Refuse a file of another kind, a truncated NIfTI and a MetaImage that is not as it says.

    Raises:
        InputError: with what was expected, found and is to be done.
    """
    lower = path.name.lower()
    if not lower.endswith(_SUFFIXES):
        raise InputError(
            f"{name} must be {', '.join(_SUFFIXES)}, a DICOM folder or an archive of one, got"
            f" {path.name}: convert it."
        )
    if lower.endswith((".nii", ".nii.gz")):
        _check_nifti(name, path)
    elif lower.endswith((".mhd", ".mha")):
        _check_meta(name, path)


def _check_nifti(name: str, path: Path) -> None:
    """Compare the bytes of a NIfTI-1 or -2, unpacked, with its header's size and type."""
    try:
        with path.open("rb") as file:
            packed = file.read(2) == _GZIP
        with gzip.open(path) if packed else path.open("rb") as stream:
            head = stream.read(540)
            length = len(head)
            while block := stream.read(1 << 22):
                length += len(block)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise InputError(
            f"{name} must be a whole NIfTI, got {path.name}, whose gzip stream breaks off or is"
            " damaged: copy or export it again."
        ) from None
    expected = _nifti_bytes(head)
    if expected is None:
        raise InputError(
            f"{name} must be NIfTI, got {path.name} without its header: export it again."
        )
    if length < expected:
        raise InputError(
            f"{name} must be a whole NIfTI of {expected} bytes, got {length} in {path.name}: it is"
            " truncated; copy or export it again."
        )


def _nifti_bytes(head: bytes) -> int | None:
    """Bytes that a NIfTI header promises; None if it is none (nifti1.h, nifti2.h)."""
    for order in "<>":
        if len(head) >= 348 and struct.unpack(order + "i", head[:4])[0] == 348:
            shape = struct.unpack(order + "8h", head[40:56])
            bits, offset = struct.unpack(order + "h", head[72:74])[0], head[108:112]
            start = int(struct.unpack(order + "f", offset)[0]) if head[344:347] == b"n+1" else 348
        elif len(head) >= 540 and struct.unpack(order + "i", head[:4])[0] == 540:
            shape = struct.unpack(order + "8q", head[16:80])
            bits = struct.unpack(order + "h", head[14:16])[0]
            start = struct.unpack(order + "q", head[168:176])[0]
        else:
            continue
        if not 1 <= shape[0] <= 7:
            return None
        promised: int = (
            start + math.prod(max(int(n), 1) for n in shape[1 : 1 + shape[0]]) * bits // 8
        )
        return promised
    return None


def _check_meta(name: str, path: Path) -> None:
    """The data of a MetaImage: there, not packed in secret, long enough."""
    fields, start = _meta_header(path)
    local = fields.get("ElementDataFile", "").upper() == "LOCAL"
    data = path if local else path.parent / fields.get("ElementDataFile", "")
    if "%" in data.name or data.name in ("LIST", ""):
        return
    if not data.is_file():
        raise InputError(f"{name} {path.name} names {data.name}, which is not beside it: add it.")
    packed = fields.get("CompressedData", "False").lower() == "true"
    start = start if local else 0
    with data.open("rb") as file:
        file.seek(start)
        gzipped = file.read(2) == _GZIP
    if gzipped and not packed:
        raise InputError(
            f"{name} {path.name} must be as its header says, uncompressed, but {data.name} is"
            f" gzip: unpack it (gunzip) and name the unpacked file in {path.name}."
        )
    expected, actual = _meta_bytes(fields, packed), data.stat().st_size - start
    if actual < expected:
        raise InputError(
            f"{name} {path.name} must have {expected} bytes of data, got {actual} in {data.name}:"
            " it is truncated; copy or export it again."
        )


def _meta_header(path: Path) -> tuple[dict[str, str], int]:
    """Fields of a MetaImage header, and the byte at which it ends."""
    fields: dict[str, str] = {}
    with path.open("rb") as file:
        while (line := file.readline(4096)) and "ElementDataFile" not in fields:
            key, _, value = line.decode("latin-1").partition("=")
            fields[key.strip()] = value.strip()
            end = file.tell()
    return fields, end if fields else 0


def _meta_bytes(fields: dict[str, str], packed: bool) -> int:
    """Bytes of data that a MetaImage header promises, 0 if it does not say."""
    if packed:
        return int(fields.get("CompressedDataSize", 0))
    size = [int(n) for n in fields.get("DimSize", "0").split()]
    channels = int(fields.get("ElementNumberOfChannels", 1))
    return math.prod(size) * channels * _META_BYTES.get(fields.get("ElementType", ""), 0)
