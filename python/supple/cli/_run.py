"""What every command shares: its options, and one run from first check to written result."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from ._errors import NOT_TRUSTWORTHY
from ._json import dumps
from ._output import OutputFolder
from ._progress import Progress
from ._stop import go_on


class Run:
    """One run of a command: where it writes, what it found, whether that can be trusted.

    Used as a context: on success the files appear in the output folder, with `result` beside them
    as result.json, and the result is printed; on any exception nothing is left behind but what the
    command has chosen to `keep`.

    Attributes:
        result: what `--json` prints; commands fill it.
        progress: call it with a stage (and a fraction of it).
    """

    def __init__(self, out: Path | None, *, as_json: bool = False) -> None:
        self.result: dict[str, Any] = {}
        self.progress = Progress()
        self._as_json = as_json
        self._folder = None if out is None else OutputFolder(out)
        self._lines: list[str] = []
        self._doubts: list[str] = []
        self._obsolete: tuple[str, ...] = ()

    def out_or(self, default: Path) -> None:
        """Write to `default` unless the user chose a folder with --out."""
        if self._folder is None:
            self._folder = OutputFolder(default)

    @property
    def target(self) -> Path:
        """The output folder, for what must outlive a run that is stopped."""
        assert self._folder is not None, "a command that writes files calls out_or first"
        return self._folder.target

    def path(self, name: str) -> Path:
        """Where to write the output file `name`."""
        assert self._folder is not None, "a command that writes files calls out_or first"
        return self._folder.path(name)

    def say(self, line: str) -> None:
        """A line for people, printed at the end unless --json asks for the object instead."""
        self._lines.append(line)

    def doubt(self, reason: str) -> None:
        """The result is written all the same, but marked, and the command exits with 3."""
        self._doubts.append(reason)

    def replaces(self, names: tuple[str, ...]) -> None:
        """The files of this run take the place of these, an earlier one's, in the output folder."""
        self._obsolete = names

    def drop(self) -> None:
        """Forget the files written so far."""
        if self._folder is not None:
            self._folder.discard()

    def keep(self) -> None:
        """The files written so far appear now, whatever comes: for what is left of a failure."""
        assert self._folder is not None, "a command that writes files calls out_or first"
        names = self._publish()
        click.echo(f"supple: where it ended: {self._folder.target}: {', '.join(names)}", err=True)

    @property
    def exit_code(self) -> int:
        """0, or 3 when there are doubts."""
        return NOT_TRUSTWORTHY if self._doubts else 0

    def __enter__(self) -> Run:
        self.progress.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.progress.__exit__()
        try:
            if kind is None:
                self._finish()
        finally:
            if self._folder is not None:
                self._folder.discard()

    def _publish(self) -> list[str]:
        assert self._folder is not None
        names = self._folder.publish()
        for name in self._obsolete:
            (self._folder.target / name).unlink(missing_ok=True)
        return names

    def _finish(self) -> None:
        go_on()
        if self._doubts:
            self.result["not_trustworthy"] = self._doubts
        if self._folder is not None:
            self.path("result.json").write_text(dumps(self.result) + "\n", encoding="utf-8")
            names = self._publish()
            self.say(f"wrote {self._folder.target}: {', '.join(names)}")
        click.echo(dumps(self.result) if self._as_json else "\n".join(self._lines))
        for reason in self._doubts:
            click.echo(f"supple: not trustworthy: {reason}", err=True)


def command(work: Callable[..., None]) -> click.Command:
    """Make a command of `work(run, ...)` with its name and help; adds --out and --json."""

    @functools.wraps(work)
    def invoke(*, out: Path | None, as_json: bool, **given: Any) -> int:
        with Run(out, as_json=as_json) as run:
            work(run, **given)
        return run.exit_code

    # A raw docstring spells click's mark for lines to keep, the backspace, as two characters.
    text = inspect.cleandoc(work.__doc__ or "").replace("\\b\n", "\b\n")
    named = click.command(work.__name__.replace("_", "-"), help=text)
    folder = click.option("--out", type=click.Path(path_type=Path), help="Folder for the results.")
    machine = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
    return named(folder(machine(invoke)))
