"""A table that grows by whole lines, so that what a stopped study has found is not lost."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError


class Journal:
    """A CSV file whose first column numbers its rows, which come in any order.

    Args:
        path: the file; its folder is made.
        columns: names, the first that of the number.
        resume: go on with a file that is there; a last line that was cut off is dropped.

    Attributes:
        rows: number → cells as text, of the file so far.

    Raises:
        InputError: the file is there and not to be resumed, or has other columns.
    """

    def __init__(self, path: Path, columns: Sequence[str], *, resume: bool = False) -> None:
        self.path, self.columns = path, list(columns)
        self.rows: dict[int, list[str]] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not resume:
            raise InputError(
                f"{path} holds samples of an earlier run; add --resume to go on with them, "
                "or choose another --out."
            )
        content = path.read_bytes() if path.exists() else b""
        whole = content[: content.rfind(b"\n") + 1]
        if whole:
            self._read(whole.decode("utf-8", "replace"))
            os.truncate(path, len(whole))
        else:
            path.write_text(_line(self.columns), encoding="utf-8")

    def _read(self, text: str) -> None:
        head, *rows = csv.reader(io.StringIO(text))
        if head != self.columns or any(len(row) != len(head) for row in rows):
            raise InputError(
                f"{self.path} must have the columns {','.join(self.columns)}, "
                f"got {','.join(head)}; choose another --out."
            )
        try:
            self.rows = {int(row[0]): row for row in rows}
        except ValueError:
            raise InputError(
                f"{self.path} must begin each row with a whole number; choose another --out."
            ) from None

    def append(self, row: Sequence[object]) -> None:
        """Write a row in one piece; ``row[0]`` is its number."""
        cells = [str(cell) for cell in row]
        handle = os.open(self.path, os.O_WRONLY | os.O_APPEND)
        try:
            os.write(handle, _line(cells).encode("utf-8"))
        finally:
            os.close(handle)
        self.rows[int(cells[0])] = cells

    def table(self) -> str:
        """The whole file, its rows sorted by number."""
        return "".join(map(_line, [self.columns, *(self.rows[n] for n in sorted(self.rows))]))


def _line(cells: Sequence[str]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerow(cells)
    return buffer.getvalue()
