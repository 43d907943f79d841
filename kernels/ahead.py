"""Which kernels are compiled ahead of time, as CMake asks for them.

The choice "demo" is what `supple demo`, `supple predict` and most tests use, "all" is everything
that any shipped law can take. UFL and FFCx are not imported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from . import fingerprint, reader, targets
from .build import GCC_ONLY, OPTIMISATION
from .law import Law
from .unit import FACETS, FORMULATIONS, OFFERED, SENSITIVITY, Unit, loads

DEMO_LAWS = ("neo_hookean", "corotational_polar")
DEMO_ELEMENTS = ("P1", "P2", "Q1", "Q2")
DEMO_SKIN = "neo_hookean"
DEMO_FACETS = ("T1", "T2", "S1", "S2")
#: The synthetic patient's own law, element and form.
DEMO_TRUTH = ("mooney_rivlin", "Q1", "direct")
WAYS = ("direct", "inverse")


def demo(materials: Path) -> list[Unit]:
    """The units of the demo and of every load; no energy file is read."""

    def unit(law: str, element: str, form: str) -> Unit:
        return Unit(form, element, materials / f"{law}.py")

    solids = [unit(law, e, way) for law in DEMO_LAWS for e in DEMO_ELEMENTS for way in WAYS]
    skins = [unit(DEMO_SKIN, facet, f"skin_{way}") for facet in DEMO_FACETS for way in WAYS]
    return [*loads(), *solids, *skins, unit(*DEMO_TRUTH)]


def everything(materials: Path) -> list[Unit]:
    """Every unit of every law in a folder, and of the loads, with their sensitivities.

    Raises:
        EnergyFileError: an energy file is wrong.
    """
    files = [f for f in sorted(materials.glob("*.py")) if f.stem != "__init__"]
    plain = [*loads(), *(unit for file in files for unit in of_law(reader.read(file)))]
    return plain + [Unit(u.form + SENSITIVITY, u.element, u.law) for u in plain]


CHOICES: dict[str, Callable[[Path], list[Unit]]] = {"demo": demo, "all": everything}


def of_law(law: Law) -> list[Unit]:
    """What a law can take: formulations on their elements if a solid's, skins if isotropic."""
    takes = {
        "displacement": law.solid,
        "mixed": law.solid and law.is_split,
        "mean-dilatation": law.solid and law.is_split,
    }
    prefixes = [(FORMULATIONS[f], OFFERED[f]) for f, it_does in takes.items() if it_does]
    if "isotropic" not in law.exceptions:
        prefixes.append(("skin_", FACETS))
    return [
        Unit(prefix + way, element, law.path)
        for prefix, elements in prefixes
        for element in elements
        for way in WAYS
    ]


def as_cmake(choice: str, materials: Path) -> str:
    """What cmake/kernels.cmake needs, as CMake code: targets, flags, generator, calls of add_units.

    The units of one law and form come together, for one process generates them.

    Raises:
        EnergyFileError: an energy file that the choice reads is wrong.
    """
    batches: dict[tuple[str, str], list[str]] = {}
    for unit in CHOICES[choice](materials):
        batches.setdefault((unit.law.stem if unit.law else "", unit.form), []).append(unit.name)
    lists: dict[str, Iterable[str]] = {
        "known_targets": targets.KNOWN,
        "flags": OPTIMISATION,
        "gcc_flags": GCC_ONLY,
        "generator": (file.as_posix() for file in fingerprint.sources()),
    }
    lines = [f'set({name} "{";".join(items)}")' for name, items in lists.items()]
    lines += [f'add_units("{law}" {" ".join(names)})' for (law, _), names in batches.items()]
    return "\n".join(lines)
