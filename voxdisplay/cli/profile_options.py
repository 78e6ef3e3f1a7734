"""Options that say how a display stands, and the profile that they and ``--display`` make.

They are no arguments of the commands: whoever opens a display asks `current_profile`. Nothing of
profiles is imported until one is named.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

if TYPE_CHECKING:
    from voxdisplay.display.profile import DisplayProfile

_C = TypeVar("_C", bound=Callable[..., Any])
_NAME: Final = "voxdisplay.display_profile"
_KEYS: Final = "voxdisplay.display_keys"


def _remember_name(context: click.Context, parameter: click.Parameter, value: str | None) -> None:
    del parameter
    context.meta[_NAME] = value


def _remember_key(context: click.Context, parameter: click.Parameter, value: Any) -> None:
    if value is not None:
        context.meta.setdefault(_KEYS, {})[str(parameter.name).removeprefix("display_")] = value


def _numbers(count: int, example: str) -> Callable[[str], list[float]]:
    def parse(text: str) -> list[float]:
        try:
            found = [float(part) for part in text.split(",")]
        except ValueError:
            found = []
        if len(found) != count:
            raise click.BadParameter(f"{text!r} is not {count} numbers such as {example}")
        return found

    return parse


def _complete_profile(context: click.Context, parameter: click.Parameter, typed: str) -> list[str]:
    from voxdisplay.display.profile_files import profile_names  # noqa: PLC0415 - for completion

    del context, parameter
    return [name for name in profile_names() if name.startswith(typed)]


def _key_option(*names: str, metavar: str, help_text: str, **settings: Any) -> Callable[[_C], _C]:
    return click.option(
        *names, metavar=metavar, expose_value=False, callback=_remember_key, help=help_text,
        **settings,
    )  # fmt: skip


display_option = click.option(
    "--display",
    metavar="NAME",
    is_eager=True,  # --fit has its default from there
    expose_value=False,
    callback=_remember_name,
    shell_complete=_complete_profile,
    help="Profile of the display: a name that voxdisplay displays lists, or a .toml file. Options "
    "win over it.",
)
serial_option = _key_option(
    "--serial", "display_serial", metavar="TEXT", help_text="Refuse a device with another serial "
    "number.",
)  # fmt: skip
axes_option = _key_option(
    "--axes",
    "display_axes",
    metavar="X,Y,Z",
    help_text="Where your x, y and z run in the display's memory, such as x,-z,y.",
)
pitch_option = _key_option(
    "--pitch",
    "display_pitch_mm",
    metavar="X,Y,Z",
    type=_numbers(3, "5,5,8"),
    help_text="Distances of voxels along your x, y and z, in mm: round stays round.",
)
dim_option = _key_option(
    "--brightness",
    "display_brightness",
    metavar="SHARE",
    type=float,
    help_text="Share of the light, 0 to 1.",
)
limit_option = _key_option(
    "--limit",
    "display_limit",
    metavar="AMPS,MA",
    type=_numbers(2, "8,20"),
    help_text="Dim what takes more than AMPS, at MA milliamperes for each channel of a voxel.",
)
dither_option = _key_option(
    "--dither",
    "display_dither",
    metavar="HOW",
    type=click.Choice(["none", "ordered"]),
    help_text="ordered: show volumes with more shades than the display has.  [default: none]",
)


def standing_options(function: _C) -> _C:
    """Add ``--display``, ``--serial`` and ``--axes``."""
    for option in (axes_option, serial_option, display_option):
        function = option(function)
    return function


def picture_options(function: _C) -> _C:
    """Add what there is to say of a display that shows pictures."""
    for option in (dither_option, limit_option, dim_option, pitch_option):
        function = option(function)
    return standing_options(function)


def current_profile() -> DisplayProfile | None:
    """Return the profile of the command that runs; None without one.

    Raises
    ------
    ProfileError
        If it is not there, or wrong.

    """
    context = click.get_current_context(silent=True)
    if context is None:
        return None
    name, keys = context.meta.get(_NAME), dict(context.meta.get(_KEYS, {}))
    if name is None and not keys:
        return None
    from voxdisplay.display.profile import DisplayProfile, with_keys  # noqa: PLC0415 - see above
    from voxdisplay.display.profile_files import load_profile  # noqa: PLC0415

    profile = DisplayProfile() if name is None else load_profile(name)
    if "limit" in keys:
        keys["limit"] = dict(zip(("amps", "ma_per_channel"), keys["limit"], strict=True))
    return with_keys(profile, keys)


def profile_port(port: str | None, profile: DisplayProfile | None) -> str | None:
    """Return the port to open: that of the command line, of the profile, or of the environment.

    None of a profile with parts, each of which has its own.
    """
    context = click.get_current_context(silent=True)
    if profile is None or context is None or not (profile.port or profile.parts):
        return port
    typed = context.get_parameter_source("port") is click.core.ParameterSource.COMMANDLINE
    return port if typed else profile.port


def profile_fit(context: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """Return the fit that was asked for, or that of the profile."""
    given = context.get_parameter_source(str(parameter.name))
    if given is not click.core.ParameterSource.DEFAULT or context.meta.get(_NAME) is None:
        return value
    profile = current_profile()
    return profile.fit if profile and profile.fit else value
