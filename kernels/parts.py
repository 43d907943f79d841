"""A long kernel in parts, for a C compiler's time grows faster than the length of a function.

FFCx writes all that depends on the point as one run of scalar definitions, up to 40,000 of them.
A run longer than LONGEST becomes functions of at most PART. What one of them needs of another goes
through an array; so long a function keeps few of its values in registers anyway.

Measured with GCC 12 on tangents: 24,000 definitions (`corotational_qr` inverse on P2) take 3.3
instead of 5.6 s of compilation at the same speed, 39,000 take 6 instead of 17 s; one of 13,000
to 19,000 runs up to 9 % slower in parts, so that a shorter one stays whole.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import chain, groupby

#: Definitions that are left in one function.
LONGEST = 15_000
#: Most definitions of a part.
PART = 3000

_DEFINITION = re.compile(r"^\s*(?:static const |const )?(double|bool|int|vec|mask) (\w+) = ([^{}]*);$")
_OTHER_ARRAY = re.compile(r"\b(?!w\[)\w+\[")
_VARIABLE = re.compile(r"\b[A-Za-z_]\w*\b(?!\s*[\[(])")


#: How a variable is put into an array of doubles or of vectors, and taken out, by its type.
_PUT = {"double": {}, "vec": {"mask": "(vec){}", "double": "supple_all({})"}}
_TAKE = {"double": {}, "vec": {"mask": "(mask){}", "double": "{}[0]"}}


def in_parts(name: str, body: str, entry: str = "double") -> tuple[str, str]:
    """The functions that a kernel's body is cut into, and the body that calls them.

    Args:
        name: of the kernel.
        body: its statements, one a line; of arrays the cut runs read `w` alone.
        entry: type of the arrays' entries, double or vec.
    """
    known: dict[str, str] = {}  # variable → type, of all lines so far
    functions: list[str] = []
    result: list[str] = []
    lines = body.split("\n")
    done = 0
    for is_scalar, group in groupby(lines, _is_scalar):
        run = list(group)
        done += len(run)
        if is_scalar and len(run) > LONGEST:
            used = set(_VARIABLE.findall("\n".join(lines[done:])))
            parts, run = _cut(f"{name}_{len(functions)}", run, known, used, entry)
            functions += parts
        known |= _defined(run)
        result += run
    return "".join(functions), "\n".join(result)


def _is_scalar(line: str) -> bool:
    """Whether a line defines a scalar by scalars and entries of w."""
    found = _DEFINITION.match(line)
    return found is not None and not _OTHER_ARRAY.search(found[3])


def _defined(lines: Iterable[str]) -> dict[str, str]:
    found = (_DEFINITION.match(line) for line in lines)
    return {f[2]: f[1] for f in found if f}


def _cut(prefix: str, run: list[str], known: dict[str, str], used: set[str],
         entry: str) -> tuple[list[str], list[str]]:  # fmt: skip
    """Functions, and the lines that call them: of what they define those that are ``used``."""
    step = -(-len(run) // -(-len(run) // PART))
    pieces = [run[start : start + step] for start in range(0, len(run), step)]
    types = known | _defined(run)
    reads = [_read(piece, types) for piece in pieces]
    results = [n for n in _defined(run) if n in used]
    slots = {n: f"t[{i}]" for i, n in enumerate(dict.fromkeys(chain(*reads, results)))}
    names = [f"{prefix}_{i}" for i in range(len(pieces))]
    functions = [
        _function(name, piece, read, slots, types, entry)
        for name, piece, read in zip(names, pieces, reads, strict=True)
    ]
    calls = [
        f"{entry} t[{len(slots)}];",
        *(_put(n, slot, types, entry) for n, slot in slots.items() if n in known),
        *(f"{name}(t, w);" for name in names),
        *(_take(n, slots[n], types, entry) for n in results),
    ]
    return functions, calls


def _read(piece: list[str], types: dict[str, str]) -> list[str]:
    """Variables that a piece needs and does not define, in the order of their first use."""
    own = _defined(piece)
    values = (_DEFINITION.match(line) for line in piece)
    words = chain.from_iterable(_VARIABLE.findall(v[3]) for v in values if v)
    return [n for n in dict.fromkeys(words) if n in types and n not in own]


def _put(name: str, slot: str, types: dict[str, str], entry: str) -> str:
    return f"{slot} = {_PUT[entry].get(types[name], '{}').format(name)};"


def _take(name: str, slot: str, types: dict[str, str], entry: str) -> str:
    value = _TAKE[entry].get(types[name], "{}").format(slot)
    return f"const {types[name]} {name} = {value};"


def _function(name: str, piece: list[str], read: list[str], slots: dict[str, str],
              types: dict[str, str], entry: str) -> str:  # fmt: skip
    begin = [_take(n, slots[n], types, entry) for n in read]
    end = [_put(n, slots[n], types, entry) for n in _defined(piece) if n in slots]
    lines = "\n".join([*begin, *piece, *end])
    arguments = f"{entry}* restrict t, const {entry}* restrict w"
    return f"static __attribute__((noinline)) void {name}({arguments})\n{{\n{lines}\n}}\n"
