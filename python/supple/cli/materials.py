"""`supple materials`: the energies that ship, or what one energy file asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ._run import Run, command

if TYPE_CHECKING:
    from ..kernels.reader import Parameter
    from ..laws import Material


@command
@click.argument("law", required=False)
def materials(run: Run, law: str | None) -> None:
    """List the strain energies, with their parameters in SI.

    LAW, a name or the path of an energy file, shows that one alone. A file is read and checked,
    not compiled.
    """
    import supple

    found = supple.materials() if law is None else [supple.material(law)]
    run.result["materials"] = [_as_object(material) for material in found]
    for material in found:
        run.say(f"{material.name}: {material.reference}")
        for parameter in material.parameters:
            run.say(f"    {_as_line(parameter)}")


def _as_object(material: Material) -> dict[str, Any]:
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


def _as_line(parameter: Parameter) -> str:
    default = parameter.default
    value = f"{default:g}" if isinstance(default, int | float) else str(default)
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{parameter.name} = {value}{unit}"
