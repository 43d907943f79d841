"""A body from a case file: mesh, material, supports, loads, in the words of `supple.Body`.

[mesh]      file = "beam.msh", unit = "mm"       or  box = { cells, size, element }, in m
[material]  law = "neo_hookean", density, formulation, quadrature (degree), and the law's parameters
[[region]]  where, law, parameters               [skin]        where, law, thickness, parameters
[[fix]]     where                                [[prescribe]] where, metre = [x, y, z]
[[force]]   where, newton = [x, y, z] each node  [[traction]]  where, pascal = [x, y, z]
[[pressure]] where, pascal = p                   [gravity]     acceleration = [x, y, z]
[solve]     load_steps, rtol, max_iterations
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .. import Body, Mesh, material
from ..errors import InputError
from . import _where

if TYPE_CHECKING:
    from ..case import Table


#: Tables that may stand several times: where, and a vector under the name of its unit.
_VECTORS = {"prescribe": "metre", "force": "newton", "traction": "pascal"}


def read_body(case: Table, *, allow_energy_files: bool) -> tuple[Body, dict[str, Any]]:
    """The body that the case describes, and the settings of [solve] as keywords.

    Raises:
        InputError: a key is wrong, missing or unknown, or its value is refused by the library; an
            energy file is named and not allowed.
    """
    mesh = _mesh(case)
    body = _material(case, mesh, allow_energy_files)
    for table in case.tables("region"):
        chosen = _where.cells(table, mesh)
        law, parameters = _law(table, allow_energy_files)
        with table.named():
            body.region(chosen, law, **parameters)
    _supports_and_loads(case, body, mesh)
    _skin(case, body, mesh, allow_energy_files)
    settings = _settings(case)
    case.done()
    return body, settings


def _mesh(case: Table) -> Mesh:
    table = case.required("mesh")
    box = table.table("box")
    if box is None:
        path, unit, element = (
            table.path("file"),
            _optional(table, "unit"),
            _optional(table, "element"),
        )
        table.done()
        with table.named("file"):
            return Mesh.read(path, unit=unit, element=element)
    table.done()
    size, origin = box.vector("size"), box.vector("origin", (0.0, 0.0, 0.0))
    cells, element = box.value("cells"), box.text("element", "P1")
    box.vector("cells")  # three numbers; that they are whole is for the mesh to say
    box.done()
    with box.named():
        return Mesh.box(cells, size, element, origin)


def _optional(table: Table, key: str) -> str | None:
    return table.text(key) if key in table else None


def _material(case: Table, mesh: Mesh, allow_energy_files: bool) -> Body:
    table = case.required("material")
    density, formulation = table.number("density", 0.0), table.text("formulation", "displacement")
    degree = table.integer("quadrature", minimum=1) if "quadrature" in table else None
    law, parameters = _law(table, allow_energy_files)
    with table.named():
        return Body(mesh, law, formulation, density, degree, **parameters)


def _law(table: Table, allow_energy_files: bool) -> tuple[str, dict[str, Any]]:
    """An energy's name (or file, if those are allowed) and its parameters; the table ends here."""
    law = table.text("law")
    if law.endswith(".py"):
        if not allow_energy_files:
            raise InputError(
                f"{table.at('law')} names an energy file, {law}, which would be compiled and run; "
                "read it, then allow it with --allow-energy-files."
            )
        law = str(table.path("law"))
    with table.named("law"):
        sizes = {parameter.name: parameter.kind.size for parameter in material(law).parameters}
    return law, table.numbers(sizes)


def _supports_and_loads(case: Table, body: Body, mesh: Mesh) -> None:
    for table in case.tables("fix"):
        body.fix(_where.nodes(table, mesh))
        table.done()
    for verb, unit in _VECTORS.items():
        for table in case.tables(verb):
            chosen, value = _where.nodes(table, mesh), table.vector(unit)
            table.done()
            with table.named():
                getattr(body, verb)(chosen, value)
    for table in case.tables("pressure"):
        chosen, pressure = _where.nodes(table, mesh), table.number("pascal")
        table.done()
        with table.named():
            body.pressure(chosen, pressure)
    gravity = case.table("gravity")
    if gravity is not None:
        body.gravity(gravity.vector("acceleration"))
        gravity.done()


def _skin(case: Table, body: Body, mesh: Mesh, allow_energy_files: bool) -> None:
    table = case.table("skin")
    if table is None:
        return
    chosen, thickness = _where.nodes(table, mesh), table.number("thickness", 2e-3, above=0.0)
    law, parameters = _law(table, allow_energy_files)
    with table.named():
        body.skin(chosen, law, thickness=thickness, **parameters)


def _settings(case: Table) -> dict[str, Any]:
    table = case.table("solve")
    if table is None:
        return {}
    settings: dict[str, Any] = {
        key: table.integer(key, minimum=1)
        for key in ("load_steps", "max_iterations")
        if key in table
    }
    if "rtol" in table:
        settings["rtol"] = table.number("rtol", above=0.0)
    table.done()
    return settings
