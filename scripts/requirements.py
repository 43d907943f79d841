"""Prints what pyproject.toml requires, one a line: to build, to run and, with --dev, to develop.

`pip install -r` of these lines, then a build without isolation, needs the network once only.
"""

import sys
import tomllib
from pathlib import Path


def requirements(pyproject: Path, *, dev: bool) -> list[str]:
    """The build and run requirements of a `pyproject.toml`, and its group "dev" if asked for."""
    project = tomllib.loads(pyproject.read_text(encoding="utf-8"))
    lines = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    if dev:
        lines += project["dependency-groups"]["dev"]
    return lines


if __name__ == "__main__":
    root = Path(__file__).resolve().parent.parent
    print("\n".join(requirements(root / "pyproject.toml", dev="--dev" in sys.argv[1:])))
