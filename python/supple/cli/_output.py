"""An output folder that is there complete or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

from ..errors import InputError


class OutputFolder:
    """Files are written to a hidden folder near `target` and moved there in one go by `publish`.

    A new target appears by one rename. Into a folder that exists, files are moved one by one, each
    complete; what else lies there stays.

    Raises:
        InputError: `target` is a file, or its place cannot be written.
    """

    def __init__(self, target: Path) -> None:
        self.target = Path(os.path.abspath(target))
        self._draft: Path | None = None
        self._check()

    def path(self, name: str) -> Path:
        """Where to write the file `name` (may hold a "/") until it is published."""
        if self._draft is None:
            prefix, place = f".{self.target.name}.", self._nearest_folder(self.target)
            self._draft = self._made(prefix, place)
        file = self._draft / name
        file.parent.mkdir(parents=True, exist_ok=True)
        return file

    def publish(self) -> list[str]:
        """Move all files to the target and return their names, sorted."""
        if self._draft is None:
            return []
        names = self._names()
        if self.target.exists():
            for name in names:
                (self.target / name).parent.mkdir(parents=True, exist_ok=True)
                os.replace(self._draft / name, self.target / name)
            self.discard()
        else:
            self.target.parent.mkdir(parents=True, exist_ok=True)
            self._draft.chmod(0o777 & ~_umask())
            self._draft.rename(self.target)
            self._draft = None
        return names

    def discard(self) -> None:
        """Remove what was written and not published."""
        if self._draft is not None:
            shutil.rmtree(self._draft, ignore_errors=True)
            self._draft = None

    def _names(self) -> list[str]:
        assert self._draft is not None
        files = (file for file in self._draft.rglob("*") if file.is_file())
        return sorted(file.relative_to(self._draft).as_posix() for file in files)

    def _check(self) -> None:
        place = self._nearest_folder(self.target)
        if not place.is_dir():
            raise InputError(f"--out must name a folder, but {place} is a file; choose another.")
        if not os.access(place, os.W_OK | os.X_OK):
            raise InputError(
                f"--out {self.target} cannot be written: {place} is read-only; choose another."
            )
        self._made(f".{self.target.name}.", place).rmdir()  # before any long work

    def _made(self, prefix: str, place: Path) -> Path:
        try:
            return Path(tempfile.mkdtemp(prefix=prefix, suffix=".part", dir=place))
        except OSError as problem:
            raise InputError(
                f"--out {self.target} cannot be written: {problem.strerror}; choose another."
            ) from None

    @staticmethod
    def _nearest_folder(path: Path) -> Path:
        return next(place for place in (path, *path.parents) if os.path.lexists(place))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
