"""Viewer of the emulator: a program that ``voxdisplay-sim --view`` starts, and ends.

Its arguments and its output are described in ``firmware_sim/viewer.py``.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Callable
from typing import TypeVar

from voxdisplay.errors import MissingExtra, OpenError, TransportClosed
from voxdisplay.view.live.address import parse_address
from voxdisplay.view.live.origins import parse_origin

T = TypeVar("T")


def main() -> int:
    """Show a tap; return the exit code, 0 when the tap has ended."""
    try:
        from voxdisplay.view.live.run import run  # noqa: PLC0415 - the extra "view"
        from voxdisplay.view.live.sources import TapSource  # noqa: PLC0415
    except MissingExtra as error:
        sys.stderr.write(f"{error}: {error.hint}\n")
        return 2
    parser = argparse.ArgumentParser(description="Show an emulator's tap in browsers.")
    for option in ("--tap", "--listen"):
        parser.add_argument(
            option, type=_argument(parse_address), metavar="HOST:PORT", required=True
        )
    parser.add_argument("--title", default="voxdisplay-sim")
    parser.add_argument("--allow-origin", type=_argument(parse_origin), action="append", default=[])
    options = parser.parse_args()
    # Terminated by the emulator, it closes its connections, so that pages say that the view ended.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        (host, port), (at_host, at_port) = options.tap, options.listen
        source = TapSource(host, port, options.title)
        run(source, at_host, at_port, _announce, options.allow_origin)
    except TransportClosed:
        return 0
    except (OpenError, OSError) as error:
        sys.stderr.write(f"the live view cannot start: {error}\n")
        return 2
    return 0


def _argument(parse: Callable[[str], T]) -> Callable[[str], T]:
    """Make the message of a parser's ValueError that of argparse."""

    def parse_argument(text: str) -> T:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parse_argument


def _announce(url: str) -> None:
    sys.stdout.write(json.dumps({"url": url}) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
