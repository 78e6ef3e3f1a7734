"""Command line of ``voxdisplay-sim``: options, help, and checks that need no device."""

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NoReturn

from firmware_sim.config import (
    FEATURES,
    LIES,
    Config,
    parse_baud,
    parse_names,
    parse_number,
    parse_refresh,
    parse_size,
)
from firmware_sim.faults import KINDS, forms, parse_faults
from firmware_sim.memory import FORMATS
from firmware_sim.quoting import excerpt, printable

_EXAMPLES: Final = """\
examples:
  voxdisplay-sim
      128x128x128 rgb888 on a pseudo-terminal; its path is in the first line of output
  voxdisplay-sim --link /tmp/voxdisplay --dump front.npy
      the same under the fixed path /tmp/voxdisplay, and its picture in a file for numpy
  voxdisplay-sim --tcp 127.0.0.1:5000 --size 64x64x64 --format mono1 --refresh 0
      a smaller display on TCP that swaps at once
  voxdisplay-sim --baud 115200
      at the pace of a serial line, to see how many frames a second it carries
  voxdisplay-sim --usbip 127.0.0.1:3240
      on USB: push to usbip://127.0.0.1:3240, or attach it to a Linux kernel with
      usbip attach -r 127.0.0.1 -b 1-1 and push to usb:
  voxdisplay-sim --fault flip=1e-5,drop=1e-6 --seed 7
      on a bad line: bits inverted and bytes lost, at the same places each time
  voxdisplay-sim --show day.vxs --view
      a display that plays a recording by itself, with a live view
  voxdisplay-sim --view
      with a live view in the browser; its address is in the first line of output
"""
_FAULTS: Final = """\
faults (--fault), joined by commas:
{kinds}
  RATE is a probability from 0 to 1, such as 1e-6, for each bit (flip), each packet (lose, delay,
  reorder) or each byte (all others). A colon may stand for the equals sign. The prefix down. or
  up. limits a fault to the direction to the device, or from it: up.lose=0.01. Without it a fault
  applies to both directions, but reboot and unplug to that to the device.
"""


class _Parser(argparse.ArgumentParser):
    """Parser that reports help which cannot be written, and whose messages steer no terminal."""

    def print_help(self, file: Any = None) -> None:
        """Print the help; exit with code 2 if it cannot be written."""
        out = sys.stdout if file is None else file
        if out is None:  # the process was started without one
            return
        try:
            out.write(self.format_help())
            out.flush()
        except BrokenPipeError:  # whoever reads it has seen enough
            sys.stdout = None
        except (OSError, ValueError) as error:
            sys.stdout = None  # or what it still holds would be written at the end, and fail again
            self.error(f"the help cannot be written: {getattr(error, 'strerror', None) or error}")

    def error(self, message: str) -> NoReturn:
        """Print a message and exit with code 2."""
        super().error(printable(message))


def parse_arguments(argv: list[str] | None) -> tuple[argparse.ArgumentParser, argparse.Namespace]:
    """Parse the command line.

    Parameters
    ----------
    argv
        Arguments; None for those of the process.

    Returns
    -------
    parser
        To report errors that show later.
    options
        The values of all options.

    Raises
    ------
    SystemExit
        With code 0 after ``--help``, 2 after a bad argument; the reason is on stderr.
    """
    parser = _parser()
    options = parser.parse_args(argv)
    if options.link and (options.tcp or options.usbip):
        parser.error("--link is a name for a pseudo-terminal: leave out --tcp and --usbip")
    if options.usb_class and not options.usbip:
        parser.error("--usb-class is for --usbip")
    if options.show and options.usbip:
        parser.error("--show plays on --pty and --tcp: leave out --usbip")
    if options.allow_origin and not options.view:
        parser.error("--allow-origin is for --view")
    return parser, options


def format_address(address: tuple[Any, ...]) -> str:
    """Return an address as HOST:PORT, with brackets around an IPv6 host."""
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _parser() -> argparse.ArgumentParser:
    default = Config()
    parser = _Parser(
        prog="voxdisplay-sim",
        usage="%(prog)s [OPTION]...",
        description="Emulate a volumetric display.\n\nThe first line of output is a JSON object "
        "with its port. SIGINT and SIGTERM end it.",
        epilog=_FAULTS.format(kinds=_fault_table()) + "\n" + _EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    port = parser.add_argument_group("port")
    where = port.add_mutually_exclusive_group()
    where.add_argument("--pty", action="store_true", help="a pseudo-terminal (the default)")
    where.add_argument(
        "--tcp",
        metavar="HOST:PORT",
        type=_argument(_parse_address),
        help="a TCP port, one connection at a time; port 0 is any that is free",
    )
    where.add_argument(
        "--usbip",
        metavar="HOST:PORT",
        type=_argument(_parse_address),
        help="USB, exported by USB/IP as device 1-1; its usual port is 3240",
    )
    port.add_argument(
        "--link",
        metavar="PATH",
        type=_argument(_parse_path),
        help="keep a symbolic link to the pseudo-terminal",
    )
    port.add_argument(
        "--usb-class",
        choices=("vendor", "cdc-acm"),
        help="with --usbip: the protocol's own interface (the default), or a serial port",
    )
    port.add_argument(
        "--allow-remote",
        action="store_true",
        help="let other machines reach the port, and the page of --view",
    )
    display = parser.add_argument_group("display")
    display.add_argument(
        "--size",
        metavar="X,Y,Z",
        type=_argument(parse_size),
        help="voxels along each axis: 64x64x64 or 64,64,64 (default: 128x128x128, or as --show)",
    )
    display.add_argument(
        "--format",
        choices=tuple(FORMATS),
        type=str.lower,
        help=f"pixel format (default: {default.pixel_format}, or as --show)",
    )
    display.add_argument(
        "--refresh",
        metavar="HZ",
        type=_argument(parse_refresh),
        default=default.refresh,
        help="refresh ticks a second; 0: a swap happens at once (default: 30)",
    )
    display.add_argument(
        "--rx-buffer",
        metavar="BYTES",
        type=_argument(parse_number),
        default=default.rx_buffer,
        help="size of the receive ring, which is the credit (default: %(default)s)",
    )
    display.add_argument(
        "--features",
        metavar="NAME,...",
        type=parse_names,
        help=f"features, of {', '.join(FEATURES)} (default: all that the format allows)",
    )
    display.add_argument(
        "--lie",
        metavar="NAME,...",
        type=parse_names,
        default=default.lies,
        help=f"announce in INFO what the device does not do, of {', '.join(LIES)}",
    )
    line = parser.add_argument_group("line")
    line.add_argument(
        "--baud",
        metavar="N",
        type=_argument(parse_baud),
        default=0,
        help="carry N bits a second each way, ten to a byte; 0: no limit (default: %(default)s)",
    )
    line.add_argument(
        "--fault",
        metavar="KIND=RATE,...",
        type=_argument(parse_faults),
        default=(),
        help="a bad line: see below",
    )
    line.add_argument(
        "--seed",
        metavar="N",
        type=_argument(parse_number),
        default=0,
        help="seed of the random numbers of --fault (default: %(default)s)",
    )
    picture = parser.add_argument_group("picture")
    picture.add_argument(
        "--show",
        metavar="FILE.vxs",
        type=_argument(_parse_path),
        help="play a recording, as from a card, until a host opens a session",
    )
    picture.add_argument(
        "--dump",
        metavar="FILE.npy",
        type=_argument(_parse_path),
        help="write the front page there at the start and after each swap",
    )
    picture.add_argument(
        "--view",
        metavar="HOST:PORT",
        nargs="?",
        const=("127.0.0.1", 0),
        type=_argument(_parse_address),
        help="show the front page in browsers at that address, on this machine only unless "
        "--allow-remote is given (default: any free port of 127.0.0.1)",
    )
    picture.add_argument(
        "--allow-origin",
        metavar="ORIGIN",
        action="append",
        default=[],
        help="with --view: let pages of another address show it, such as https://cube.example.com "
        "behind a reverse proxy; may be repeated; * is all",
    )
    return parser


def _fault_table() -> str:
    rows = [(" or ".join(forms(name)), kind.EFFECT) for name, kind in KINDS.items()]
    width = max(len(forms) for forms, _ in rows)
    return "\n".join(f"  {forms:<{width}}  {effect}" for forms, effect in rows)


def _argument(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a parser whose ValueError argparse reports with its own message."""

    def parse_argument(text: str) -> Any:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parse_argument


def _parse_address(text: str) -> tuple[str, int]:
    match = re.fullmatch(r"\[?([^\[\]]+?)\]?:([0-9]{1,5})", text)
    if not match or int(match[2]) > 0xFFFF:
        raise ValueError(f"{excerpt(text)} is no address: write HOST:PORT like 127.0.0.1:5000")
    return match[1], int(match[2])


def _parse_path(text: str) -> Path:
    path = Path(text)
    if not path.name or "\0" in text:
        raise ValueError(f"{excerpt(text)} is no file name")
    return path
