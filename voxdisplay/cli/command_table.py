"""Table of commands with their summaries, and a click group that imports a command when it is run.

The help of the group and the completion of command names import neither numpy nor any command.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Final, NamedTuple

import click

from voxdisplay.errors import did_you_mean

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class TableEntry(NamedTuple):
    """Location and summary of a command."""

    module: str  # in voxdisplay.cli
    attribute: str
    summary: str  # at most 60 characters, so that it fits a line of 80


# In the order of the help, by heading.
COMMANDS: Final[dict[str, dict[str, TableEntry]]] = {
    "Show on a display": {
        "push": TableEntry("push", "push", "Show a scene or model and prove that it is shown."),
        "play": TableEntry("play", "play", "Play moving scenes, recordings and playlists."),
        "test-pattern": TableEntry(
            "test_pattern", "test_pattern", "Show a pattern that tells the axes apart."
        ),
        "clear": TableEntry("device_commands", "clear", "Make a display dark."),
    },
    "Examine a display": {
        "ports": TableEntry("ports", "ports", "List serial ports and displays on USB."),
        "displays": TableEntry(
            "displays", "displays", "List the profiles that --display NAME takes."
        ),
        "info": TableEntry(
            "device_commands", "info", "Print size, format and features of a display."
        ),
        "read": TableEntry(
            "device_commands", "read", "Save what a display shows as a file of voxels."
        ),
        "view": TableEntry("view", "view", "Show a display live, in a browser or this terminal."),
        "bench": TableEntry("bench", "bench", "Measure the speed of this machine and a port."),
    },
    "Work without a display": {
        "voxelize": TableEntry("voxelize", "voxelize", "Write the voxels of a scene's curves."),
        "preview": TableEntry("preview", "preview", "Draw a scene as a picture or a film."),
        "convert": TableEntry(
            "convert", "convert", "Write the voxels of a scene or model for other programs."
        ),
        "plan": TableEntry("plan", "plan_command", "Print bytes and frames per second of a scene."),
        "record": TableEntry("record", "record", "Record a moving scene as ready packets."),
        "show": TableEntry("show", "show", "Examine, repair or convert recordings."),
        "schema": TableEntry(
            "document_paths", "schema", "Print the path of the JSON Schema of scenes."
        ),
    },
    "Develop a device": {
        "conformance": TableEntry(
            "conformance", "conformance", "Check a device against protocol.md."
        ),
        "annotate": TableEntry("annotate", "annotate", "Explain a capture of push --capture."),
        "protocol": TableEntry("document_paths", "protocol", "Print the path of protocol.md."),
    },
}
ENTRIES: Final = {name: entry for group in COMMANDS.values() for name, entry in group.items()}


class LazyGroup(click.Group):
    """A group whose commands are imported when they are run or asked for their help."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands, in the order of the help."""
        del ctx
        return list(ENTRIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; None if there is none of this name."""
        del ctx
        entry = ENTRIES.get(cmd_name)
        if entry is None:
            return None
        command = getattr(import_module(f"voxdisplay.cli.{entry.module}"), entry.attribute)
        assert isinstance(command, click.Command)  # noqa: S101 - a test imports all
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Look up the command of a command line, or raise with the nearest name."""
        name = args[0]
        if name not in ENTRIES and not name.startswith("-") and not ctx.resilient_parsing:
            hint = did_you_mean(name, ENTRIES)
            ctx.fail(f"no such command: {name!r}" + (f"; {hint}" if hint else ""))
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the sections of commands, from the table."""
        del ctx
        width = max(map(len, ENTRIES))
        for heading, commands in COMMANDS.items():
            with formatter.section(heading):
                rows = [(name.ljust(width), entry.summary) for name, entry in commands.items()]
                formatter.write_dl(rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Offer the names of commands with their summaries, then the group's own options."""
        from click.shell_completion import CompletionItem  # noqa: PLC0415 - only for completion

        items = [
            CompletionItem(name, help=entry.summary)
            for name, entry in ENTRIES.items()
            if name.startswith(incomplete)
        ]
        return items + click.Command.shell_complete(self, ctx, incomplete)
