"""``voxdisplay displays``: the user's display profiles."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import click

from voxdisplay.cli.options import json_option, quiet_option
from voxdisplay.cli.output import note, plural, print_json, print_stdout

if TYPE_CHECKING:
    from voxdisplay.display.profile import DisplayProfile


@click.command(
    epilog="""\b
    Examples:
      voxdisplay displays
      voxdisplay push curve.json --display desk
      voxdisplay test-pattern --ask desk
    """
)
@json_option
@quiet_option
def displays(*, as_json: bool) -> None:
    """List the profiles that --display NAME takes: TOML files in your folder of profiles."""
    from voxdisplay.display.profile_files import (  # noqa: PLC0415 - help starts without numpy
        load_profile,
        profile_folder,
        profile_names,
        profile_path,
    )
    from voxdisplay.errors import ProfileError  # noqa: PLC0415

    found: list[dict[str, Any]] = []
    for name in profile_names():
        entry: dict[str, Any] = {"name": name, "file": str(profile_path(name))}
        try:
            profile = load_profile(name)
        except ProfileError as error:
            entry["error"] = f"{error}{f'; {error.hint}' if error.hint else ''}"
        else:
            limit = profile.limit
            entry |= {
                "port": profile.port,
                "serial": profile.serial,
                "axes": profile.axes.names,
                "mirrored": profile.axes.mirrors,
                "pitch_mm": list(profile.pitch_mm),
                "brightness": profile.brightness,
                "limit": None if limit is None else limit._asdict(),
                "dither": profile.dither,
                "fit": profile.fit,
                **_parts_entry(profile),
            }
        found.append(entry)
    if as_json:
        print_json({"folder": str(profile_folder()), "displays": found})
        return
    if not found:
        note(f"no display profiles in {profile_folder()}: test-pattern --ask NAME writes one")
        return
    width = max(len(entry["name"]) for entry in found)
    for entry in found:
        told = f"wrong: {entry['error']}" if "error" in entry else _summary(entry)
        print_stdout(f"{entry['name']:<{width}}  {told}")
        if drawing := entry.get("layout"):
            print_stdout(textwrap.indent("\n".join([*entry["layout_faults"], drawing]), "  "))


def _parts_entry(profile: DisplayProfile) -> dict[str, Any]:
    """Return what a profile says of its parts; nothing if it has none."""
    if not profile.parts:
        return {}
    from voxdisplay.display.part_layout import PartLayout  # noqa: PLC0415 - few have parts

    layout = PartLayout(profile.parts)
    return {
        "size": list(layout.grid),
        "parts": [
            {
                "name": part.name,
                "port": part.port,
                "serial": part.serial,
                "at": list(part.at),
                "size": list(part.size),
                "axes": part.axes.names,
            }
            for part in profile.parts
        ],
        "layout_faults": layout.faults(),
        "layout": layout.drawing(),
    }


def _summary(entry: dict[str, Any]) -> str:
    """Return what a profile says beyond the defaults."""
    if made_of := entry.get("parts"):
        size = "x".join(map(str, entry["size"]))
        parts = [f"{size} of {plural(len(made_of), 'part')}"]
    else:
        parts = [entry["port"] or "any port", f"axes {','.join(entry['axes'])}"]
    if entry["mirrored"]:
        parts[-1] += " (mirrored)"
    if entry["serial"]:
        parts.append(f"serial {entry['serial']}")
    if len(set(entry["pitch_mm"])) > 1:
        parts.append(f"pitch {' x '.join(f'{each:g}' for each in entry['pitch_mm'])} mm")
    if entry["brightness"] != 1:
        parts.append(f"brightness {entry['brightness']:g}")
    if entry["limit"]:
        parts.append(f"limit {entry['limit']['amps']:g} A")
    if entry["dither"] != "none":
        parts.append(f"dither {entry['dither']}")
    if entry["fit"]:
        parts.append(f"fit {entry['fit']}")
    return ", ".join(parts)
