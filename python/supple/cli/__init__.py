"""The `supple` command. One file a command; `COMMANDS` lists them in the order of `--help`."""

from __future__ import annotations

from ._main import main

#: Names of the commands; "rest-shape" is the object `rest_shape` of the file rest_shape.py.
COMMANDS: tuple[str, ...] = (
    "demo", "predict", "register", "template", "solve", "rest-shape", "study", "materials",
)  # fmt: skip

__all__ = ["COMMANDS", "main"]
