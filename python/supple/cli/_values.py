"""NAME=VALUE options: parameters of a law."""

from __future__ import annotations

from typing import Any

from ..errors import InputError


def values(option: str, texts: tuple[str, ...]) -> dict[str, Any]:
    """Name → number, or (3,) direction of "fibre=1,0,0".

    Raises:
        InputError: another form, or a name given twice.
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if not name or len(numbers) not in (1, 3):
            raise InputError(
                f"{option} must be NAME=VALUE, such as young=3e3 or fibre=1,0,0, got {text!r}."
            )
        if name in found:
            raise InputError(f"{option} gives {name} twice; leave one out.")
        found[name] = numbers[0] if len(numbers) == 1 else numbers
    return found
