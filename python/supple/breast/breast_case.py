"""What a prediction is asked for: a case file, or an image and the options of the command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from supple.breast.model import SUPPORTS, Materials
from supple.breast.tissues import Tissue
from supple.case import Table, read_case
from supple.errors import InputError

Point = tuple[float, float, float]
#: Parameters that a scan can identify, and those that it does.
IDENTIFIABLE = ("breast.young", "skin.young")


@dataclass(frozen=True)
class Identify:
    """How parameters are found from a scan."""

    parameters: tuple[str, ...] = IDENTIFIABLE
    method: str = "cma-es"
    seed: int = 1
    evaluations: int = 40


@dataclass(frozen=True)
class Case:
    """One patient; places in LPS mm, as everywhere at the door.

    Attributes:
        image: prone MRI: a file, or a folder or archive of a DICOM series.
        tumour_mm: centre in the prone image.
        diameter_mm: of the tumour; None: no cells are tumour beyond the labels.
        labels: label image of `Tissue` codes; None: the image is segmented.
        scan: supine surface scan; None: no alignment, no identification.
        scan_unit: of the scan.
        nipple_mm: of the breast with the tumour, prone; None: estimated.
        seeds: points known to be in a tissue, for the segmentation.
        edge_mm: longest edge of the mesh; None: the mesher's choice.
        support: "fixed" or "sliding" chest wall.
    """

    image: Path
    tumour_mm: Point
    diameter_mm: float | None = None
    labels: Path | None = None
    scan: Path | None = None
    scan_unit: str = "mm"
    nipple_mm: Point | None = None
    seeds: Mapping[Tissue, Sequence[Point]] = field(default_factory=dict)
    edge_mm: float | None = None
    support: str = "fixed"
    materials: Materials = field(default_factory=Materials)
    identify: Identify = field(default_factory=Identify)

    def checked(self) -> Case:
        """Itself, after its files were seen to exist.

        Raises:
            InputError: a file that is missing, named with its role.
        """
        for role in ("image", "labels", "scan"):
            path = getattr(self, role)
            if path is not None and not path.exists():
                raise InputError(f"{role} {path} does not exist; check the path.")
        return self


def read_breast_case(path: str | Path, allow_energy_files: bool = False) -> Case:
    """Read a case.toml; DESIGN §9 shows one. Paths are relative to its folder.

    Raises:
        InputError: a wrong or unknown key (the nearest is named), a missing file.
    """
    table = read_case(path)
    image, tumour = table.required("image"), table.required("tumour")
    case = Case(
        image=image.path("file"),
        labels=image.path("labels") if "labels" in image else None,
        tumour_mm=_point(tumour, "centre_mm"),
        diameter_mm=tumour.number("diameter_mm", above=0.0) if "diameter_mm" in tumour else None,
        nipple_mm=_point(tumour, "nipple_mm") if "nipple_mm" in tumour else None,
    )
    case = _scan(case, table.table("scan"))
    _pose(table.table("pose"))
    case = _model(case, table.table("model"))
    case = replace(case, materials=_materials(table.table("material"), allow_energy_files))
    case = replace(case, identify=_identify(table.table("identify")))
    for known in (image, tumour, table):
        known.done()
    return case.checked()


def with_options(case: Case, **options: Any) -> Case:
    """The case with those options of the command that were given (not None)."""
    return replace(case, **{k: v for k, v in options.items() if v is not None}).checked()


def parse_seeds(words: Sequence[str]) -> dict[Tissue, list[Point]]:
    """``fat:x,y,z`` and so on, LPS mm, to points by tissue.

    Raises:
        InputError: an unknown tissue or something that is no point.
    """
    seeds: dict[Tissue, list[Point]] = {}
    for word in words:
        name, _, place = word.partition(":")
        known = {t.name.lower(): t for t in Tissue if t is not Tissue.TUMOUR}
        if name.lower() not in known:
            raise InputError(f"seeds must be {'|'.join(known)}:x,y,z in LPS mm, got {word!r}.")
        seeds.setdefault(known[name.lower()], []).append(parse_point("seeds", place))
    return seeds


def parse_point(option: str, text: str) -> Point:
    """``x,y,z`` in LPS mm.

    Raises:
        InputError: not three numbers.
    """
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(
            f"{option} must be three numbers x,y,z in LPS mm, got {text!r}; "
            "for example --tumour=-62,-140.5,12."
        ) from None
    return x, y, z


def _point(table: Table, key: str) -> Point:
    x, y, z = table.vector(key)
    return float(x), float(y), float(z)


def _scan(case: Case, scan: Table | None) -> Case:
    if scan is None:
        return case
    unit = scan.text("unit", "mm", choices=("mm", "m", "cm"))
    case = replace(case, scan=scan.path("file"), scan_unit=unit)
    scan.done()
    return case


def _pose(pose: Table | None) -> None:
    if pose is None:
        return
    pose.text("image", "prone", choices=("prone",))
    pose.text("target", "supine", choices=("supine",))
    pose.done()


def _model(case: Case, model: Table | None) -> Case:
    if model is None:
        return case
    edge = model.number("edge_mm", above=0.0) if "edge_mm" in model else None
    support = model.text("support", "fixed", choices=SUPPORTS)
    model.done()
    return replace(case, edge_mm=edge, support=support)


def _materials(table: Table | None, allow_energy_files: bool) -> Materials:
    made = Materials()
    if table is None:
        return made
    breast, skin = table.table("breast"), table.table("skin")
    if breast is not None:
        law = _law(breast, made.law, allow_energy_files)
        density = breast.number("density", made.density, above=0.0)
        own = dict(made.breast) if law == made.law else {}
        values = {**own, **_numbers(breast, law)}
        made = replace(made, law=law, density=density, breast=values)
        breast.done()
    for part in ("gland", "tumour"):
        given = table.table(part)
        if given is not None:
            made = replace(made, **{part: _numbers(given, made.law)})
            given.done()
    if skin is not None:
        law = _law(skin, made.skin_law, allow_energy_files)
        thickness = skin.number("thickness", made.thickness, above=0.0)
        own = dict(made.skin) if law == made.skin_law else {}
        values = {**own, **_numbers(skin, law)}
        made = replace(made, skin_law=law, thickness=thickness, skin=values)
        skin.done()
    table.done()
    return made


def _law(table: Table, default: str, allow_energy_files: bool) -> str:
    law = table.text("law", default)
    if law.endswith(".py"):
        if not allow_energy_files:
            raise table.wrong("law", "a shipped energy, or --allow-energy-files for a file", law)
        return str(table.path("law"))
    return law


def _numbers(table: Table, law: str) -> dict[str, Any]:
    from supple.laws import material

    return table.numbers([p.name for p in material(law).parameters])


def _identify(table: Table | None) -> Identify:
    made = Identify()
    if table is None:
        return made
    names = table.value("parameters") if "parameters" in table else list(made.parameters)
    if not isinstance(names, list) or not names or not set(names) <= set(IDENTIFIABLE):
        raise table.wrong("parameters", f"a list of {', '.join(IDENTIFIABLE)}", names)
    made = Identify(
        tuple(names),
        table.text("method", made.method, choices=("cma-es",)),
        table.integer("seed", made.seed),
        table.integer("evaluations", made.evaluations, minimum=4),
    )
    table.done()
    return made
