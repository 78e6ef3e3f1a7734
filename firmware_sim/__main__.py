"""The program ``voxdisplay-sim``: a device on a pseudo-terminal, a TCP port, or on USB/IP.

Its first line on stdout is a JSON object that says where the device is; all else goes to stderr.
"""

import argparse
import contextlib
import json
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from firmware_sim.baud_pacing import PacedDevice, with_baud
from firmware_sim.bench import Bench
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
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.faults import parse_faults
from firmware_sim.memory import FORMATS
from firmware_sim.npy import write_npy
from firmware_sim.serve import (
    listen_tcp,
    open_pty,
    require_loopback,
    serve_tcp,
    serve_wire,
    symbolic_link,
)
from firmware_sim.tap import Tap
from firmware_sim.usb.device import UsbDevice
from firmware_sim.usb.function import DisplayFunction, SerialFunction
from firmware_sim.usb.usbip_server import serve_usbip
from firmware_sim.viewer import viewer

_EPILOG = """\
examples:
  voxdisplay-sim
      128x128x128 rgb888 on a pseudo-terminal; its path is in the first line
  voxdisplay-sim --link /tmp/voxdisplay --dump front.npy
      the same, always to be found as /tmp/voxdisplay, and the picture in a file for numpy
  voxdisplay-sim --tcp 127.0.0.1:5000 --size 64x64x64 --format mono1 --refresh 0
      a smaller one on TCP that swaps at once
  voxdisplay-sim --baud 115200
      at the pace of a serial line, to see how many frames a second it carries
  voxdisplay-sim --usbip 127.0.0.1:3240
      on USB: push to usbip://127.0.0.1:3240, or attach it to a Linux kernel with
      usbip attach -r 127.0.0.1 -b 1-1 and push to usb:
  voxdisplay-sim --fault flip=1e-5,drop=1e-6 --seed 7
      on a bad line: bits inverted and bytes lost, at the same places each time
  voxdisplay-sim --view
      with a page for the browser that shows what is on display; its address is in the first line
"""


def main(argv: list[str] | None = None) -> int:
    """Run the program.

    Parameters
    ----------
    argv
        Arguments; None for those of the process.

    Returns
    -------
    int
        Exit code: 0 after SIGINT or SIGTERM. Bad arguments exit with 2.
    """
    parser = _parser()
    options = parser.parse_args(argv)
    if options.link and (options.tcp or options.usbip):
        parser.error("--link is a name for a pseudo-terminal: leave out --tcp and --usbip")
    if options.usb_class and not options.usbip:
        parser.error("--usb-class is for --usbip")
    if options.allow_origin and not options.view:
        parser.error("--allow-origin is for --view")
    try:
        config = Config(
            options.size,
            options.format,
            options.refresh,
            options.rx_buffer,
            features=options.features,
            lies=options.lie,
        )
        device = Device(config)
        if options.dump:
            _dump_swaps(device, options.dump)
        with _stop_on_signal() as stop:
            wire = DeviceOnLine(device, options.fault, options.seed)
            _serve(with_baud(wire, options.baud), options, stop)
    except (ValueError, OSError) as error:
        parser.error(str(error))
    return 0


def _parser() -> argparse.ArgumentParser:
    default = Config()
    parser = argparse.ArgumentParser(
        prog="voxdisplay-sim",
        description="Emulate a volumetric display.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    place = parser.add_mutually_exclusive_group()
    place.add_argument(
        "--pty", action="store_true", help="be found on a pseudo-terminal (the default)"
    )
    place.add_argument(
        "--tcp",
        metavar="HOST:PORT",
        type=_argument(_parse_address),
        help="be found on a TCP port, one connection at a time; port 0 is any that is free",
    )
    place.add_argument(
        "--usbip",
        metavar="HOST:PORT",
        type=_argument(_parse_address),
        help="be found on USB, exported by USB/IP as device 1-1; its usual port is 3240",
    )
    parser.add_argument(
        "--usb-class",
        choices=("vendor", "cdc-acm"),
        help="with --usbip: the protocol's own interface (the default), or a serial port",
    )
    parser.add_argument(
        "--allow-remote",
        action="store_true",
        help="let other machines reach the port, and the page of --view",
    )
    parser.add_argument(
        "--link", metavar="PATH", type=Path, help="keep a symbolic link to the pseudo-terminal"
    )
    parser.add_argument(
        "--size",
        metavar="NXxNYxNZ",
        type=_argument(parse_size),
        default=default.grid,
        help="grid (default: 128x128x128)",
    )
    parser.add_argument(
        "--format",
        choices=tuple(FORMATS),
        default=default.pixel_format,
        help="pixel format (default: %(default)s)",
    )
    parser.add_argument(
        "--refresh",
        metavar="HZ",
        type=_argument(parse_refresh),
        default=default.refresh,
        help="refresh ticks a second; 0: a swap happens at once (default: 30)",
    )
    parser.add_argument(
        "--baud",
        metavar="N",
        type=_argument(parse_baud),
        default=0,
        help="take and give bytes at the pace of a line of N bits a second, ten to a byte; 0: as "
        "fast as they come (default: %(default)s)",
    )
    parser.add_argument(
        "--rx-buffer",
        metavar="BYTES",
        type=_argument(parse_number),
        default=default.rx_buffer,
        help="size of the receive ring, which is the credit (default: %(default)s)",
    )
    parser.add_argument(
        "--features",
        metavar="NAME,...",
        type=parse_names,
        help=f"what it can, of {', '.join(FEATURES)} (default: all that the format allows)",
    )
    parser.add_argument(
        "--lie",
        metavar="NAME,...",
        type=parse_names,
        default=default.lies,
        help=f"announce what it does not do, of {', '.join(LIES)}",
    )
    parser.add_argument(
        "--fault",
        metavar="SPEC",
        type=_argument(parse_faults),
        default=(),
        help="a bad line, as below",
    )
    parser.add_argument(
        "--seed",
        metavar="N",
        type=_argument(parse_number),
        default=0,
        help="where the chance of --fault begins (default: %(default)s)",
    )
    parser.add_argument(
        "--dump",
        metavar="FILE.npy",
        type=Path,
        help="write the front page there at the start and after each swap",
    )
    parser.add_argument(
        "--view",
        metavar="HOST:PORT",
        nargs="?",
        const=("127.0.0.1", 0),
        type=_argument(_parse_address),
        help="show the front page in browsers at that address, on this machine only unless "
        "--allow-remote is given (default: any free port of 127.0.0.1)",
    )
    parser.add_argument(
        "--allow-origin",
        metavar="ORIGIN",
        action="append",
        default=[],
        help="with --view: let pages of another address show it, such as https://cube.example.com "
        "behind a reverse proxy; may be repeated; * is all",
    )
    return parser


def _argument(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """Make the message of a parser's ValueError that of argparse."""

    def parse_argument(text: str) -> Any:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parse_argument


def _parse_address(text: str) -> tuple[str, int]:
    match = re.fullmatch(r"\[?([^\[\]]+?)\]?:([0-9]{1,5})", text)
    if not match or int(match[2]) > 0xFFFF:
        raise ValueError(f"{text!r} is no address: write HOST:PORT like 127.0.0.1:5000")
    return match[1], int(match[2])


def _dump_swaps(device: Device, path: Path) -> None:
    bench = Bench(device)
    write_npy(path, bench.snapshot())  # what cannot be written is better known at the start

    def dump() -> None:
        try:
            write_npy(path, bench.snapshot())
        except OSError as error:
            sys.stderr.write(f"voxdisplay-sim: {error}: this picture is not dumped\n")

    _on_swap_also(device, dump)


def _on_swap_also(device: Device, act: Callable[[], object]) -> None:
    """Do something more at each swap."""
    before = device.on_swap

    def both() -> None:
        before()
        act()

    device.on_swap = both


@contextlib.contextmanager
def _stop_on_signal() -> Iterator[int]:
    """Turn SIGINT and SIGTERM into a file descriptor that becomes readable."""
    stop, stopper = os.pipe()
    names = (signal.SIGINT, signal.SIGTERM)
    handlers = [signal.signal(name, lambda *_: os.write(stopper, b"\0")) for name in names]
    try:
        yield stop
    finally:
        for name, handler in zip(names, handlers, strict=True):
            signal.signal(name, handler)
        os.close(stop)
        os.close(stopper)


def _serve(wire: DeviceOnLine | PacedDevice, options: argparse.Namespace, stop: int) -> None:
    with contextlib.ExitStack() as stack:
        port, serve = _open_carrier(wire, options, stack)
        config = wire.device.config
        place = {"port": port, "size": str(config.shape), "format": config.pixel_format}
        if options.view:
            require_loopback(options.view[0], remote=options.allow_remote)
            tap = stack.enter_context(Tap(wire.device))
            _on_swap_also(wire.device, tap.notify_swap)
            address = _format_address(options.view)
            place["view"] = stack.enter_context(viewer(tap, address, port, options.allow_origin))
        _announce(place)
        serve(stop)


def _open_carrier(
    wire: DeviceOnLine | PacedDevice, options: argparse.Namespace, stack: contextlib.ExitStack
) -> tuple[str, Callable[[int], object]]:
    """Open what carries the bytes; return its port, and what serves it until told to stop."""
    if options.tcp:
        listener = stack.enter_context(listen_tcp(*options.tcp, remote=options.allow_remote))
        port = f"tcp://{_format_address(listener.getsockname())}"
        return port, lambda stop: serve_tcp(wire, listener, stop)
    if options.usbip:
        kind = SerialFunction if options.usb_class == "cdc-acm" else DisplayFunction
        listener = stack.enter_context(listen_tcp(*options.usbip, remote=options.allow_remote))
        port = f"usbip://{_format_address(listener.getsockname())}"
        return port, lambda stop: serve_usbip(UsbDevice(kind(wire)), listener, stop)
    line, port = stack.enter_context(open_pty())
    if options.link:
        stack.enter_context(symbolic_link(options.link, port))
    return port, lambda stop: serve_wire(wire, line, stop)


def _announce(place: dict[str, str]) -> None:
    sys.stdout.write(json.dumps(place) + "\n")
    sys.stdout.flush()


def _format_address(place: tuple[Any, ...]) -> str:
    """Write an address as `_parse_address` reads it."""
    host, port = place[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


if __name__ == "__main__":
    sys.exit(main())
