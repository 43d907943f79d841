"""What the command says when it fails: one sentence on stderr, or one JSON object on stdout."""

from __future__ import annotations

from typing import Any

import click

from ..errors import ConvergenceError, InputError, SuppleError
from ._json import dumps

BAD_INPUT = 2
NOT_TRUSTWORTHY = 3


def exit_code(error: SuppleError | click.ClickException) -> int:
    """2 for what the user can correct in the input, 3 for a result that could not be had."""
    if isinstance(error, (InputError, click.ClickException)):
        return BAD_INPUT
    return NOT_TRUSTWORTHY


def report(error: SuppleError | click.ClickException, *, as_json: bool) -> None:
    """Write the error to stderr, or as {"error": {...}} to stdout."""
    if as_json:
        click.echo(dumps({"error": _as_object(error)}))
    elif isinstance(error, click.ClickException):
        error.show()
    else:
        click.echo(f"supple: {error}", err=True)


def _as_object(error: SuppleError | click.ClickException) -> dict[str, Any]:
    message = error.format_message() if isinstance(error, click.ClickException) else str(error)
    described: dict[str, Any] = {"type": type(error).__name__, "message": message}
    if isinstance(error, ConvergenceError):
        described |= {
            "cause": error.cause,
            "load_factor": error.load_factor,
            "cells": error.cells,
            "history": error.history,
        }
    return described
