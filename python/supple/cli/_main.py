"""From arguments to an exit code: 0 good, 2 bad input, 3 no result to be trusted, 130 Ctrl-C."""

from __future__ import annotations

import errno
import importlib
import sys
from collections.abc import Sequence

import click

from .. import __version__
from ..errors import InputError, SuppleError
from ._errors import exit_code, report
from ._stop import cleanly_stopped

INTERRUPTED = 130
_FULL = (errno.ENOSPC, errno.EDQUOT)


class CommandFiles(click.Group):
    """Looks a command up in the file of its name, so that only the one that runs is loaded."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names, in the order of the package's list."""
        from . import COMMANDS

        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, or None."""
        if cmd_name not in self.list_commands(ctx):
            return None
        attribute = cmd_name.replace("-", "_")
        module = importlib.import_module(f"supple.cli.{attribute}")
        found: click.Command = getattr(module, attribute)
        return found


def _print_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if not wanted:
        return
    click.echo(f"supple {__version__}")
    ctx.exit()


@click.group(cls=CommandFiles, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version,
    help="Show the version and exit.",
)  # fmt: skip
def supple() -> None:
    """Strain energies in one line, fast finite elements, and where a tumour lies supine.

    Exit codes: 0 the result is good, 2 bad input, 3 no convergence or a result not to be trusted.
    Research use only.
    """


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `supple` with these arguments (default: the process's) and return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        with cleanly_stopped():
            return int(supple.main(given, prog_name="supple", standalone_mode=False) or 0)
    except (SuppleError, click.ClickException) as error:
        report(error, as_json="--json" in given)
        return exit_code(error)
    except OSError as problem:
        if problem.errno not in _FULL:
            raise
        full = InputError("no room is left on the disk, so that nothing was written; make room, or "
                          "choose another --out.")  # fmt: skip
        report(full, as_json="--json" in given)
        return exit_code(full)
    except (KeyboardInterrupt, click.Abort) as stop:
        click.echo(f"supple: {str(stop) or 'interrupted, nothing was written'}", err=True)
        return INTERRUPTED
