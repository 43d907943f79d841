"""An energy file, read with `ast` against a short whitelist, then run with nothing but our words.

    text → tree → checked → Law (name, parameters, exceptions, functions)

A file cannot import, loop over data, reach an attribute that starts with an underscore or name
anything that is not of `energy`; each refusal names file, line and remedy.
"""

from __future__ import annotations

import ast
import difflib
import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from . import energy
from .kinematics import ATTRIBUTES
from .law import BUILTINS, ENTRY_POINTS, EXCEPTIONS, EnergyFileError, Law, Parameter, blamed

__all__ = ["EnergyFileError", "Law", "Parameter", "blamed", "nearest", "read"]

#: Names that a parameter may not have: the kernels' own fields and the arguments of `supple.Body`.
RESERVED = ("u", "thickness", "mesh", "material", "formulation", "density", "quadrature", "where",
            "cells", "number", "points", "gravity", "traction", "pressure", "skin")  # fmt: skip
#: Powers and ranges of plain numbers stay small: reading a file cannot take long.
LARGEST_EXPONENT, LONGEST_RANGE = 64, 1000

_EXPRESSIONS = (
    ast.BinOp, ast.UnaryOp, ast.Call, ast.Attribute, ast.Name, ast.Constant, ast.Tuple, ast.Load,
    ast.Store, ast.operator, ast.unaryop, ast.GeneratorExp, ast.comprehension, ast.keyword,
    ast.Subscript, ast.Starred,
)  # fmt: skip


def read(path: Path | str) -> Law:
    """Read and check an energy file.

    Raises:
        EnergyFileError: with file, line and remedy, for anything outside of DESIGN §3.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text, filename=str(path))
    except OSError as problem:
        raise EnergyFileError(f"{path}: cannot be read ({problem.strerror}).") from None
    except (SyntaxError, UnicodeDecodeError, ValueError) as problem:
        line = getattr(problem, "lineno", 1)
        raise EnergyFileError(f"{path}:{line}: is not Python ({problem}).") from None
    checker = _Checker(path, tree)
    checker.module()
    return Law(
        name=path.stem,
        path=path,
        reference=(ast.get_docstring(tree) or "").split("\n\n")[0].replace("\n", " "),
        parameters=checker.parameters(),
        exceptions=checker.exceptions,
        source_hash=hashlib.sha256(ast.dump(tree).encode()).hexdigest(),
        line=next(f.lineno for n, f in checker.functions.items() if n in ENTRY_POINTS),
        _code=compile(_without_annotations(tree), str(path), "exec"),
    )


def nearest(word: str, words: Any) -> str:
    """'; did you mean X?' or a list of what there is: the remedy for an unknown name."""
    close = difflib.get_close_matches(word, list(words), n=1, cutoff=0.5)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(sorted(words))}."


def _without_annotations(tree: ast.Module) -> ast.Module:
    for f in (n for n in tree.body if isinstance(n, ast.FunctionDef)):
        for argument in f.args.args:
            argument.annotation = None
        f.returns = None
    tree.body = [n for n in tree.body if not isinstance(n, ast.ImportFrom)]
    return tree


class _Checker:
    """Walks the tree once; every refusal is one sentence."""

    def __init__(self, path: Path, tree: ast.Module) -> None:
        self.path, self.tree = path, tree
        self.exceptions: frozenset[str] = frozenset()
        self.imported: set[str] = set()
        self.functions = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}

    def fail(self, node: ast.AST, what: str) -> EnergyFileError:
        return EnergyFileError(f"{self.path}:{getattr(node, 'lineno', 1)}: {what}")

    def module(self) -> None:
        if not ast.get_docstring(self.tree):
            raise self.fail(self.tree, "has no docstring; begin with its formula and source.")
        for node in self.tree.body[1:]:
            self.statement(node)
        if not {"psi", "psi_dev", "psi_surface"} & set(self.functions):
            raise self.fail(
                self.tree, "defines no energy; define psi(k, ...), or psi_dev and psi_vol."
            )
        if "psi_dev" in self.functions and not {"psi", "psi_vol"} & set(self.functions):
            raise self.fail(self.tree, "defines psi_dev without psi_vol; add psi_vol(J, ...).")
        for f in self.functions.values():
            self.function(f)

    def statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.ImportFrom) and node.module == "supple.energy":
            for alias in node.names:
                if alias.name not in energy.__all__ or alias.asname:
                    hint = nearest(alias.name, energy.__all__)
                    raise self.fail(node, f"supple.energy has no {alias.name}; {hint}")
                self.imported.add(alias.name)
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            raise self.fail(node, "imports something else than supple.energy; remove that import.")
        elif isinstance(node, ast.Assign) and [ast.unparse(t) for t in node.targets] == [
            "exceptions"
        ]:
            self.exceptions = self.declared(node)
        elif not isinstance(node, ast.FunctionDef):
            kind = type(node).__name__
            raise self.fail(
                node, f"{kind} is not allowed here; a file holds functions of expressions."
            )

    def declared(self, node: ast.Assign) -> frozenset[str]:
        try:
            names = set(ast.literal_eval(node.value))
        except (ValueError, TypeError):
            raise self.fail(node, 'exceptions must be a set such as {"barrier"}.') from None
        for name in names:
            if name not in EXCEPTIONS:
                raise self.fail(
                    node, f"unknown exception {name!r}; {nearest(str(name), EXCEPTIONS)}"
                )
        return frozenset(names)

    def function(self, f: ast.FunctionDef) -> None:
        a = f.args
        if a.vararg or a.kwarg or a.kwonlyargs or a.posonlyargs or f.decorator_list:
            raise self.fail(f, f"{f.name} may only have plain arguments and no decorator.")
        if f.name in ENTRY_POINTS and len(a.args) <= len(a.defaults):
            raise self.fail(f, f"{f.name} must begin with {'J' if f.name == 'psi_vol' else 'k'}.")
        for default in a.defaults:  # they run when the file is read
            self.number(f, f"a default of {f.name}", default)
        known = {x.arg for x in a.args} | self.imported | set(BUILTINS) | set(self.functions)
        for index, node in enumerate(f.body):
            if index == 0 and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                continue
            if isinstance(node, ast.Assign) and len(node.targets) == 1:
                self.expression(node.value, known)
                for name in ast.walk(node.targets[0]):
                    if isinstance(name, ast.Name):
                        known.add(name.id)
                    elif not isinstance(name, (ast.Tuple, ast.Store)):
                        raise self.fail(node, "assigns to something else than names.")
            elif isinstance(node, ast.Return) and node.value is not None:
                self.expression(node.value, known)
            else:
                kind = type(node).__name__
                raise self.fail(node, f"{kind} is not allowed; use assignments and one return.")
        if not isinstance(f.body[-1], ast.Return):
            raise self.fail(f, f"{f.name} returns nothing; end it with return and the energy.")

    def expression(self, tree: ast.expr, known: set[str]) -> None:
        bound = {n.id for c in ast.walk(tree) if isinstance(c, ast.comprehension)
                 for n in ast.walk(c.target) if isinstance(n, ast.Name)}  # fmt: skip
        for node in ast.walk(tree):
            if not isinstance(node, _EXPRESSIONS):
                raise self.fail(node, f"{type(node).__name__} is not allowed in an energy.")
            if isinstance(node, ast.Constant) and not isinstance(node.value, (int, float)):
                raise self.fail(node, f"the constant {node.value!r} is not a number.")
            if isinstance(node, ast.Name) and node.id not in known | bound:
                hint = nearest(node.id, (known | set(energy.__all__)) - set(ENTRY_POINTS))
                raise self.fail(node, f"unknown name {node.id}; {hint}")
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
                self.power(node)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "range":
                self.range(node)
            if isinstance(node, ast.Attribute):
                self.attribute(node)

    def power(self, node: ast.BinOp) -> None:
        if any(isinstance(n, (ast.Name, ast.Attribute)) for n in ast.walk(node.left)):
            return
        exponent = node.right.value if isinstance(node.right, ast.Constant) else None
        nested = any(isinstance(n, ast.Pow) for n in ast.walk(node.left))
        if nested or not isinstance(exponent, (int, float)) or abs(exponent) > LARGEST_EXPONENT:
            raise self.fail(node, f"a number's exponent must be at most {LARGEST_EXPONENT}.")

    def range(self, node: ast.Call) -> None:
        ends = [n.value for n in node.args if isinstance(n, ast.Constant)]
        small = [n for n in ends if isinstance(n, int) and 0 <= n <= LONGEST_RANGE]
        if len(small) != len(node.args):
            raise self.fail(node, f"range takes whole numbers up to {LONGEST_RANGE}.")

    def attribute(self, node: ast.Attribute) -> None:
        on_k = isinstance(node.value, ast.Name) and node.value.id == "k"
        if on_k and node.attr not in ATTRIBUTES:
            raise self.fail(node, f"k has no {node.attr}; {nearest(node.attr, ATTRIBUTES)}")
        if not on_k and node.attr not in ("T", "U", "g"):
            raise self.fail(node, f"the attribute {node.attr} is not allowed; only those of k are.")

    def parameters(self) -> tuple[Parameter, ...]:
        found: dict[str, Parameter] = {}
        for name in ENTRY_POINTS:
            if name not in self.functions:
                continue
            f = self.functions[name]
            arguments = f.args.args[1:]
            defaults: list[ast.expr | None] = [None] * (len(arguments) - len(f.args.defaults))
            for argument, default in zip(arguments, defaults + list(f.args.defaults), strict=True):
                p = self.parameter(argument, default)
                if found.setdefault(p.name, p) != p:
                    raise self.fail(argument, f"{p.name} differs from its other declaration.")
        return tuple(found.values())

    def number(self, node: ast.AST, what: str, default: ast.expr) -> Any:
        try:
            value = ast.literal_eval(default)
            float(sum(value)) if isinstance(value, tuple) else float(value)
        except (ValueError, TypeError):
            raise self.fail(node, f"{what} is not a number.") from None
        return value

    def parameter(self, argument: ast.arg, default: ast.expr | None) -> Parameter:
        name = argument.arg
        if argument.annotation is None or default is None:
            raise self.fail(
                argument, f"{name} needs a type and a default, such as {name}: Pa = 1e3."
            )
        if name in RESERVED:
            raise self.fail(
                argument, f"{name} is a name of Supple's own; call the parameter otherwise."
            )
        value = self.number(argument, f"the default of {name}", default)
        kind = self.kind(argument.annotation, name)
        if np.shape(value) != ((kind.size,) if kind.size > 1 else ()):
            raise self.fail(argument, f"the default of {name} must be {kind.size} number(s).")
        if not kind.admits(value):
            raise self.fail(argument, f"the default of {name} is {value}, outside {kind.range()}.")
        return Parameter(name, kind, kind.normalised(value) if kind.size > 1 else value)

    def kind(self, annotation: ast.expr, name: str) -> energy.Kind:
        call = annotation if isinstance(annotation, ast.Call) else None
        word = call.func if call else annotation
        kind = getattr(energy, word.id, None) if isinstance(word, ast.Name) else None
        if not isinstance(kind, energy.Kind):
            raise self.fail(
                annotation,
                f"{name} has an unknown type; use Pa, Ratio, Number, Metre or Direction.",
            )
        if call is None:
            return kind
        try:
            bounds = {k.arg: ast.literal_eval(k.value) for k in call.keywords if k.arg}
            return kind(**bounds)
        except (ValueError, TypeError):
            raise self.fail(
                annotation, f"the bounds of {name} are wrong; write Pa(minimum=0.0)."
            ) from None
