"""`supple materials`: the energies that ship, and tools for those who write their own."""

from __future__ import annotations

import difflib
import importlib
from pathlib import Path

import click

from ._run import Run

TOOLS = ("show", "new", "check", "fit")


class Tools(click.Group):
    """Looks a tool up in the file of its name; any other first word is a law to show."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The tools, in the order in which an author needs them."""
        return list(TOOLS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The tool of that name, or None."""
        if cmd_name not in TOOLS:
            return None
        module = importlib.import_module(f"supple.cli.materials_{cmd_name}")
        found: click.Command = getattr(module, cmd_name)
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """``materials NAME`` is ``materials show NAME``, unless NAME is a misspelt tool."""
        misspelt = difflib.get_close_matches(args[0], TOOLS, n=1, cutoff=0.7)
        if args[0] in TOOLS or args[0].startswith("-"):
            return super().resolve_command(ctx, args)
        if misspelt:
            ctx.fail(f"there is no command {args[0]}; did you mean {misspelt[0]}?")
        return super().resolve_command(ctx, ["show", *args])


@click.group(cls=Tools, invoke_without_command=True)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the results.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def materials(ctx: click.Context, out: Path | None, as_json: bool) -> int:
    """List the strain energies that ship; show, write, check and fit them.

    `supple materials NAME` is short for `supple materials show NAME`. NAME may be the path of an
    energy file of your own: wherever Supple takes a name, it takes such a path.
    """
    if ctx.invoked_subcommand is not None:
        if out is not None or as_json:
            raise click.UsageError(f"--out and --json go after {ctx.invoked_subcommand}.", ctx)
        return 0
    with Run(out, as_json=as_json) as run:
        _list(run)
    return run.exit_code


def _list(run: Run) -> None:
    import supple

    from .materials_show import as_object

    found = supple.materials()
    run.result["materials"] = [as_object(material) for material in found]
    width = max(len(material.name) for material in found)
    for material in found:
        run.say(f"{material.name:{width}}  {material.reference}")
