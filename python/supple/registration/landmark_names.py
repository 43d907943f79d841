"""What people call the landmarks of a torso, brought to the template's names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

from supple.errors import InputError
from supple.registration.template import LANDMARKS

#: Words of a place, after the words of a side are taken out: the template's name of it.
_PLACES = {
    "sternal notch": (
        "sternal notch", "sternum notch", "notch", "jugulum", "jugular notch", "jugular", "ssn",
        "suprasternal notch", "suprasternale", "suprasternal", "incisura jugularis", "sn",
    ),
    "xiphoid": (
        "xiphoid", "xyphoid", "xiphoid process", "xyphoid process", "xiphoid tip", "xiphisternum",
        "processus xiphoideus", "sternum inferior", "xp",
    ),
    "nipple": ("nipple", "nip", "nipple tip", "mamilla", "mammilla", "papilla", "areola"),
    "axilla": ("axilla", "armpit", "axillary fold", "anterior axillary fold", "axillary", "ax"),
    "breast medial": (
        "breast medial", "medial breast", "medial", "inner breast", "breast inner",
        "medial border", "breast medial border", "medial breast border",
    ),
    "breast lateral": (
        "breast lateral", "lateral breast", "lateral", "outer breast", "breast outer",
        "lateral border", "breast lateral border", "lateral breast border",
    ),
    "breast inferior": (
        "breast inferior", "inferior breast", "inferior", "lower breast", "breast lower", "imf",
        "inframammary fold", "inferior mammary fold", "submammary fold", "inframammary",
        "breast inferior border", "inferior breast border", "inferior border",
    ),
}  # fmt: skip
_PLACE = {word: place.replace(" ", "_") for place, words in _PLACES.items() for word in words}
_SIDES = {word: side for side, words in
          (("left", ("left", "l", "lt", "lft", "sinister", "sin", "links", "gauche")),
           ("right", ("right", "r", "rt", "rgt", "dexter", "dex", "rechts", "droit", "droite")))
          for word in words}  # fmt: skip
_FILLERS = {"the", "of", "point", "landmark", "lm", "pt"}


def landmark_name(label: str, names: Iterable[str] = LANDMARKS) -> str:
    """The template's name of ``label``: "Nipple L", "jugulum" or "xyphoid" are understood.

    Raises:
        InputError: no landmark of this name (the nearest are offered), or one of a pair without
            its side.
    """
    names = list(names)
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", label)
    tokens = re.sub(r"[^a-z0-9]+", " ", words.lower()).split()
    plain = "_".join(tokens)
    if plain in names:
        return plain
    sides = {_SIDES[t] for t in tokens if t in _SIDES}
    rest = " ".join(t for t in tokens if t not in _SIDES and t not in _FILLERS)
    if not sides and rest[:1] in "lr" and rest[1:] in _PLACE:  # "LNipple", "rnipple"
        sides, rest = {_SIDES[rest[0]]}, rest[1:]
    if not sides and rest[-1:] in "lr" and rest[:-1] in _PLACE:
        sides, rest = {_SIDES[rest[-1]]}, rest[:-1]
    near = [rest] if rest in _PLACE else get_close_matches(rest, _PLACE, n=1, cutoff=0.75)
    if len(sides) > 1 or not near:
        raise InputError(_unknown(label, plain, names))
    place = _PLACE[near[0]]
    found = f"{place}_{next(iter(sides))}" if sides else place
    if found in names:
        return found
    if not sides and f"{place}_left" in names:
        raise InputError(
            f"landmark {label!r} needs its side; name it '{place}_left' or '{place}_right'."
        )
    raise InputError(_unknown(label, plain, names))


def _unknown(label: str, plain: str, names: list[str]) -> str:
    near = get_close_matches(plain, names, n=3, cutoff=0.5)
    offer = f"; the nearest are {', '.join(near)}" if near else f"; known are {', '.join(names)}"
    return f"no landmark is called {label!r}{offer}; rename or remove it."
