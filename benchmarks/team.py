"""The codes that newton.py measures: each a process of its own, asked by a line of JSON."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

HERE = Path(__file__).parent
SOLVERS = ("auto", "direct", "pardiso")
#: Whose assembly is the measure.
REFERENCE = "DOLFINx, 1 rank"


@dataclass
class Code:
    """One code; ``also`` is added to each request."""

    name: str
    command: list[str]
    also: dict[str, Any] = field(default_factory=dict)
    ours: bool = False
    foreign: bool = True  # another interpreter, which our PYTHONPATH would mislead
    threads: int | None = None  # of OpenMP; as the environment says if None
    process: subprocess.Popen[str] | None = None
    errors: IO[str] | None = None

    def start(self, stack: ExitStack) -> None:
        """Begin to listen, until the stack unwinds."""
        environment = dict(os.environ)
        if self.foreign:
            environment.pop("PYTHONPATH", None)
        if self.threads:
            environment["OMP_NUM_THREADS"] = str(self.threads)
        self.errors = tempfile.TemporaryFile("w+")  # noqa: SIM115
        stack.enter_context(self.errors)
        self.process = subprocess.Popen(
            self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors,
            text=True, env=environment,
        )  # fmt: skip
        stack.callback(self.stop)

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Its answer; a reason under "skip" where it has none."""
        process = self.process
        if process is None or process.stdin is None or process.stdout is None:
            raise RuntimeError(f"{self.name} was not started")
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps(request | self.also) + "\n")
            process.stdin.flush()
        line = process.stdout.readline()
        if not line:
            return {"skip": f"ended on {request['element']} {request['law']}: {self.last_words()}"}
        answer: dict[str, Any] = json.loads(line)
        return answer

    def last_words(self) -> str:
        """Exit status and the last line on the error stream."""
        status = self.process.wait() if self.process else None
        if self.errors is None:
            return f"status {status}"
        self.errors.seek(0)
        return f"status {status}, {(self.errors.read().strip().splitlines() or ['no word'])[-1]}"

    def stop(self) -> None:
        """End the process, which leaves at the end of its input."""
        if self.process is not None:
            self.process.communicate()


def add_options(parser: argparse.ArgumentParser) -> None:
    """Where the peers are."""
    parser.add_argument("--dolfinx", type=Path, help="an interpreter that has DOLFINx")
    parser.add_argument("--felupe", type=Path, help="an interpreter that has FElupe")
    parser.add_argument("--febio", type=Path, help="FEBio's executable")


def assemble(given: argparse.Namespace, stack: ExitStack) -> tuple[list[Code], list[str]]:
    """All codes that are there, started, and why the others are not."""
    ours = [sys.executable, str(HERE / "supple_newton.py")]
    codes = [
        Code(f"Supple, {solver}", ours, {"solver": solver}, ours=True, foreign=False)
        for solver in SOLVERS
    ]
    absent = []
    for name, option, make in (
        ("DOLFINx", given.dolfinx, dolfinx),
        ("FElupe", given.felupe, felupe),
        ("FEBio", given.febio, febio),
    ):
        if option is None:
            absent.append(f"{name}: not given, --{name.lower()}")
        elif found := shutil.which(option):
            codes += make(Path(found).absolute())
        else:
            absent.append(f"{name}: {option.name} is no program at the place given")
    for code in codes:
        code.start(stack)
    return codes, absent


def script(name: str) -> str:
    """Path of a peer's script."""
    return str(HERE / "peers" / f"{name}_newton.py")


def dolfinx(python: Path) -> list[Code]:
    """On one rank and on two, with MUMPS' LDLᵀ: faster than its LU; its LLᵀ may give NaN on two."""
    one = [str(python), script("dolfinx")]
    codes = [Code(REFERENCE, one, {"factor": "ldlt"}, threads=1)]
    beside = python.parent / "mpirun"
    mpirun = str(beside) if beside.exists() else shutil.which("mpirun")
    if mpirun and (os.cpu_count() or 1) > 1:
        two = [mpirun, "-np", "2", *one]
        codes.append(Code("DOLFINx, 2 ranks", two, {"factor": "ldlt"}, threads=1))
    return codes


def felupe(python: Path) -> list[Code]:
    """With its einsum in threads."""
    return [Code("FElupe", [str(python), script("felupe")])]


def febio(exe: Path) -> list[Code]:
    """On as many threads as there are cores."""
    threads = str(os.cpu_count())
    command = [sys.executable, script("febio"), str(exe), threads]
    return [Code(f"FEBio, {threads} threads", command, foreign=False)]
