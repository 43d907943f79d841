"""`supple materials show`: one energy, as its author wrote it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ._run import Run, command

if TYPE_CHECKING:
    from ..laws import Material


@command
@click.argument("law", metavar="NAME|FILE")
def show(run: Run, law: str) -> None:
    """Show an energy: source, ψ as written, parameters with units and bounds, exceptions.

    A file is read and checked, not compiled.
    """
    import supple

    from ..author import source

    material = supple.material(law)
    written = source.functions(material.path)
    about = source.docstring(material.path)
    run.result |= {**as_object(material), "docstring": about, "psi": written}
    run.say(f"{material.name}: {about}\n")
    run.say("\n".join(f"    {line}".rstrip() for line in written.splitlines()))
    run.say("\nparameters (SI), each one number or one a cell:")
    for parameter in material.parameters:
        run.say(f"    {source.parameter_line(parameter)}")
    if material.exceptions:
        run.say(f"declared exceptions: {', '.join(sorted(material.exceptions))}")
    run.say(f"file: {material.path}")


def as_object(material: Material) -> dict[str, Any]:
    """A material for JSON."""
    return {
        "name": material.name,
        "reference": material.reference,
        "path": material.path,
        "exceptions": sorted(material.exceptions),
        "parameters": [
            {
                "name": parameter.name,
                "unit": parameter.unit,
                "default": parameter.default,
                "minimum": parameter.kind.minimum,
                "maximum": parameter.kind.maximum,
            }
            for parameter in material.parameters
        ],
    }
