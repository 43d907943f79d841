"""What a prediction is asked for: a case file, or an image and options; checked before any work.

[image]    file = "prone.mha", labels = "labels.mha"
[tumour]   centre_mm = [x, y, z] LPS, diameter_mm = 12, nipple_mm = [x, y, z]
[scan]     file = "supine.ply", unit = "mm"
[pose]     image = "prone", target = "supine"
[nipple]   centre_mm = [x, y, z] prone
[seeds]    air, fat, gland, chest = [[x, y, z], ...] mm
[material.breast]  law, density, softest, and the law's parameters;  gland, tumour: parameters
[material.skin]    young, thickness
[support]  chest = "fixed" or "sliding"
[mesh]     edge_mm
[identify] parameters = ["breast.young", "skin.young"], method, seed, evaluations, workers
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from supple import parameters
from supple.breast.identify import METHODS, IdentifySettings
from supple.breast.model import SUPPORTS, Materials
from supple.breast.tissues import Tissue
from supple.case import Table, read_case
from supple.errors import InputError
from supple.files import METRES
from supple.laws import read_law

Point = tuple[float, float, float]
#: Assumed where a case gives no diameter, mm.
DIAMETER = 10.0


@dataclass(frozen=True)
class Case:
    """One prediction, as it is asked for.

    Attributes:
        image: prone image.
        tumour_mm: centre in the image, LPS mm.
        tumour_diameter_mm: its diameter; None where it is not known.
        labels: label image; None to segment the image.
        scan: supine surface; None to use the materials as they are.
        scan_unit: its unit of length.
        still: brush file (`brush_region`, mm) of the skin in the image to align the scan by;
            None for the skin between the breasts and above them.
        nipple_mm: prone nipple of the breast with the tumour; None to estimate it.
        seeds: points known to be in a tissue, mm.
        materials: laws and parameters, where the identification starts.
        softest: make the tissue as soft as it can be.
        support: of the chest wall.
        edge_mm: of the mesh; None for one of a usual size.
        identify: how; None without a scan.
        title: what the user calls it.
    """

    image: Path
    tumour_mm: Point
    tumour_diameter_mm: float | None = None
    labels: Path | None = None
    scan: Path | None = None
    scan_unit: str = "mm"
    still: Path | None = None
    nipple_mm: Point | None = None
    seeds: dict[Tissue, list[Point]] = field(default_factory=dict)
    materials: Materials = field(default_factory=Materials)
    softest: bool = False
    support: str = "fixed"
    edge_mm: float | None = None
    identify: IdentifySettings = field(default_factory=IdentifySettings)
    title: str = ""


def read_breast_case(path: str | Path, *, allow_energy_files: bool = False) -> Case:
    """Read a case file.

    Raises:
        InputError: a key is missing, unknown or wrong, a file does not exist, a law or a parameter
            is not known or out of bounds, an energy file is named and not allowed.
    """
    top = read_case(path)
    image, tumour = top.required("image"), top.required("tumour")
    scan, model = top.table("scan"), top.table("model")
    materials, softest = _materials(top.table("material"), allow_energy_files)
    case = Case(
        image=image.path("file"),
        labels=image.path("labels") if "labels" in image else None,
        tumour_mm=_point(tumour, "centre_mm"),
        tumour_diameter_mm=_diameter(tumour),
        scan=None if scan is None else scan.path("file"),
        scan_unit="mm" if scan is None else scan.text("unit", "mm", choices=tuple(METRES)),
        still=None if scan is None or "still" not in scan else scan.path("still"),
        nipple_mm=_point(tumour, "nipple_mm") if "nipple_mm" in tumour else None,
        seeds=_seeds(top.table("seeds")),
        materials=materials,
        softest=softest,
        support=SUPPORTS[0] if model is None else _support(model),
        edge_mm=_edge(model) if model is not None else None,
        identify=_identify(top.table("identify"), materials),
        title=Path(path).name,
    )
    _check_pose(top.table("pose"))
    for table in filter(None, (image, tumour, scan, model, top)):
        table.done()
    return case


def with_options(case: Case, **options: Any) -> Case:
    """The case with what was given on the command line in place of what it says itself."""
    given = {name: value for name, value in options.items() if value is not None}
    for name in ("image", "labels", "scan", "still"):
        path = given.get(name)
        if path is not None and not path.exists():
            raise InputError(f"{name} {path} does not exist; give an existing path.")
    diameter = given.get("tumour_diameter_mm")
    if diameter is not None and not 1.0 <= diameter <= 150.0:
        raise InputError(f"the tumour's diameter must be 1 to 150 mm, got {diameter:g}.")
    return replace(case, **given)


def parse_point(text: str, name: str) -> Point:
    """The three numbers of X,Y,Z."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"{name} must be X,Y,Z in mm such as -62,-140.5,12, got {text!r}."
        ) from None
    if not all(abs(value) < 1e4 for value in (x, y, z)):
        raise InputError(f"{name} must be three finite coordinates in mm, got {text!r}.")
    return x, y, z


def parse_seeds(texts: tuple[str, ...]) -> dict[Tissue, list[Point]]:
    """Seeds written as TISSUE:X,Y,Z."""
    seeds: dict[Tissue, list[Point]] = {}
    for text in texts:
        name, _, place = text.partition(":")
        known = [t.name.lower() for t in Tissue if t != Tissue.TUMOUR]
        if name not in known:
            raise InputError(
                f"--seeds must be TISSUE:X,Y,Z with a tissue of {', '.join(known)}, got {text!r}."
            )
        seeds.setdefault(Tissue[name.upper()], []).append(parse_point(place, "--seeds"))
    return seeds


def _point(table: Table, key: str) -> Point:
    x, y, z = table.vector(key)
    return x, y, z


def _diameter(table: Table) -> float | None:
    key = "diameter_mm"
    return table.number(key, above=1.0, below=150.0) if key in table else None


def _check_pose(table: Table | None) -> None:
    if table is not None:
        table.text("image", "prone", choices=("prone",))
        table.text("target", "supine", choices=("supine",))
        table.done()


def _support(model: Table) -> str:
    return model.text("support", SUPPORTS[0], choices=SUPPORTS)


def _edge(model: Table) -> float | None:
    return model.number("edge_mm", above=2.0, below=60.0) if "edge_mm" in model else None


def _seeds(table: Table | None) -> dict[Tissue, list[Point]]:
    seeds: dict[Tissue, list[Point]] = {}
    if table is None:
        return seeds
    for tissue in (Tissue.AIR, Tissue.FAT, Tissue.GLAND, Tissue.CHEST):
        key = tissue.name.lower()
        if key not in table:
            continue
        given = table.value(key)
        if not isinstance(given, list):
            raise table.wrong(key, "a list of points [x, y, z] in mm", given)
        points = [Table({key: point}, table.file, table.name).vector(key) for point in given]
        seeds[tissue] = [(x, y, z) for x, y, z in points]
    table.done()
    return seeds


def _materials(table: Table | None, allow_energy_files: bool) -> tuple[Materials, bool]:
    made, is_softest = Materials(), False
    if table is None:
        return made, is_softest
    breast, skin = table.table("breast"), table.table("skin")
    if breast is not None:
        law = _law(breast, allow_energy_files)
        density = breast.number("density", made.density, above=0.0, below=1e5)
        is_softest = breast.flag("softest", False)
        known = {p.name for p in read_law(law).parameters}
        usual = {name: value for name, value in made.breast.items() if name in known}
        values = usual | _law_values(breast, law)
        made = replace(made, law=law, density=density, breast=values)
    if skin is not None:
        thickness = skin.number("thickness", made.thickness, above=0.0, below=0.05)
        values = {**made.skin, **_law_values(skin, made.skin_law, skin=True)}
        made = replace(made, thickness=thickness, skin=values)
    gland, tumour = (_part(table, part, made.law) for part in ("gland", "tumour"))
    table.done()
    return replace(made, gland=gland, tumour=tumour), is_softest


def _part(table: Table, name: str, law: str) -> dict[str, float]:
    part = table.table(name)
    return {} if part is None else _law_values(part, law)


def _law_values(table: Table, law: str, skin: bool = False) -> dict[str, float]:
    read = read_law(law)
    values: dict[str, float] = table.numbers({p.name: p.kind.size for p in read.parameters})
    table.done()
    with table.named():
        parameters.given(read, values, 1, skin)
    return values


def _law(table: Table, allow_energy_files: bool) -> str:
    law = table.text("law", Materials().law)
    if law.endswith(".py") or "/" in law or "\\" in law:
        if not allow_energy_files:
            raise InputError(
                f"{table.at('law')} names an energy file, {law}, which would be compiled and run; "
                "read it, then allow it with --allow-energy-files."
            )
        return str(table.path("law"))
    with table.named("law"):
        read_law(law)
    return law


def _identify(table: Table | None, materials: Materials) -> IdentifySettings:
    usual = IdentifySettings()
    if table is None:
        known = {"skin.young", *(f"breast.{name}" for name in materials.breast)}
        return replace(usual, parameters=tuple(n for n in usual.parameters if n in known))
    names = table.value("parameters") if "parameters" in table else list(usual.parameters)
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise table.wrong("parameters", 'a list of names such as "breast.young"', names)
    for name in names:
        with table.named("parameters"):
            materials.of(name)
    settings = replace(
        usual,
        parameters=tuple(names),
        method=table.text("method", usual.method, choices=METHODS),
        seed=table.integer("seed", usual.seed, minimum=1),
        evaluations=table.integer("evaluations", usual.evaluations, minimum=7),
        workers=table.integer("workers", usual.workers, minimum=1),
    )
    table.done()
    return settings
