"""``voxdisplay protocol`` and ``schema``: paths of documents installed with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from voxdisplay.cli.output import print_stdout

_PACKAGE: Final = Path(__file__).resolve().parents[1]
SCHEMA: Final = _PACKAGE / "scene.schema.json"


def protocol_path(name: str = "protocol.md") -> Path:
    """Return the path of protocol.md, or of recording.md or vectors.json.

    A wheel installs it in the package; in a checkout it lies beside the package.

    Raises
    ------
    click.ClickException
        If the installation lacks it.

    """
    return _existing(_PACKAGE / name, _PACKAGE.parent / name)


def _existing(*places: Path) -> Path:
    for path in places:
        if path.is_file():
            return path
    raise click.ClickException(
        f"{places[0]} is missing: this installation is not complete; install voxdisplay again"
    )


@click.command(
    epilog="""\b
    Examples:
      voxdisplay protocol
      less "$(voxdisplay protocol)"
      less "$(voxdisplay protocol --recording)"
      jq .vectors "$(voxdisplay protocol --vectors)"
    """
)
@click.option(
    "--recording",
    is_flag=True,
    help="Of recording.md instead, the description of recordings (.vxs).",
)
@click.option("--vectors", is_flag=True, help="Of its vectors as JSON instead.")
def protocol(*, recording: bool, vectors: bool) -> None:
    """Print the path of protocol.md, the description of the wire for whoever builds a device."""
    if recording and vectors:
        raise click.UsageError("--recording and --vectors are two files; give one of them")
    name = "recording.md" if recording else "vectors.json" if vectors else "protocol.md"
    print_stdout(str(protocol_path(name)))


@click.command(
    epilog="""\b
    Examples:
      voxdisplay schema
      cp "$(voxdisplay schema)" scene.schema.json
    """
)
def schema() -> None:
    """Print the path of the JSON Schema of scene files, for editors and validators."""
    print_stdout(str(_existing(SCHEMA)))
