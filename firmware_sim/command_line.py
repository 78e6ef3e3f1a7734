"""The emulator as a program: a device on a pseudo-terminal, a TCP port, or USB/IP, until a signal.

The first line on stdout is a JSON object with the device's port; everything else goes to stderr.
"""

import contextlib
import json
import sys
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from firmware_sim.arguments import format_address, parse_arguments
from firmware_sim.baud_pacing import PacedDevice, with_baud
from firmware_sim.bench import Bench
from firmware_sim.card_player import CardPlayer, Packets, read_head
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.npy import write_npy
from firmware_sim.quoting import printable
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

_Runner = Callable[[int], object]


def run(argv: list[str] | None, stop: int) -> int:
    """Run the emulator until it is told to stop.

    Parameters
    ----------
    argv
        Arguments; None for those of the process.
    stop
        File descriptor that becomes readable when it is time to stop.

    Returns
    -------
    int
        Exit code: 0 if it was told to stop, 2 if a port or file cannot be opened, if there is no
        such device, or not enough memory for what is drawn.
    """
    parser, options = parse_arguments(argv)
    try:
        with contextlib.ExitStack() as stack:
            show = stack.enter_context(_open_show(options.show)) if options.show else None
            device = _device(options, show)
            if options.dump:
                _dump_swaps(device, options.dump)
            player = _player(device, show, options.show)
            wire = DeviceOnLine(device, options.fault, options.seed, player=player)
            _serve(with_baud(wire, options.baud), options, stop)
            if player:
                _note(
                    f"{options.show}: {player.shown} frames shown, {player.wrong} of them with "
                    f"another digest, {player.skipped} left out"
                )
    except ValueError as error:
        parser.error(str(error))
    except OSError as error:
        _note(f"error: {error.strerror or error}")
        return 2
    except MemoryError:
        _note("error: what is lit needs more memory than there is: take a smaller --size")
        return 2
    return 0


def _open_show(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as error:
        raise OSError(f"{path}: {error.strerror}") from error


def _device(options: Namespace, show: BinaryIO | None) -> Device:
    default = Config()
    grid, pixel_format, max_payload = default.grid, default.pixel_format, default.max_payload
    if show:
        try:
            head = read_head(Packets(show))
        except ValueError as error:
            raise ValueError(f"{options.show}: {error}") from error
        grid, pixel_format = head.grid, head.pixel_format
        max_payload = max(max_payload, head.max_payload)
    config = Config(
        options.size or grid,
        options.format or pixel_format,
        options.refresh,
        options.rx_buffer,
        max_payload,
        features=options.features,
        lies=options.lie,
    )
    return Device(config)


def _player(device: Device, show: BinaryIO | None, path: Path) -> CardPlayer | None:
    """Return the player of a recording that is open, if any."""
    if show is None:
        return None
    try:
        player = CardPlayer(device, show)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    _on_swap_also(device, player.exchanged)
    return player


def _dump_swaps(device: Device, path: Path) -> None:
    """Write the front page to a file now and after each swap."""
    bench = Bench(device)
    write_npy(path, bench.snapshot())  # a file that cannot be written is reported at the start

    def dump() -> None:
        try:
            write_npy(path, bench.snapshot())
        except OSError as error:
            _note(f"{error}: this picture is not dumped")

    _on_swap_also(device, dump)


def _on_swap_also(device: Device, act: Callable[[], object]) -> None:
    """Call a function at each swap, after those set before."""
    before = device.on_swap

    def both() -> None:
        before()
        act()

    device.on_swap = both


def _serve(wire: DeviceOnLine | PacedDevice, options: Namespace, stop: int) -> None:
    with contextlib.ExitStack() as stack:
        port, serve = _open_carrier(wire, options, stack)
        config = wire.device.config
        place = {"port": port, "size": str(config.shape), "format": config.pixel_format}
        if options.view:
            require_loopback(options.view[0], remote=options.allow_remote)
            tap = stack.enter_context(Tap(wire.device))
            _on_swap_also(wire.device, tap.notify_swap)
            address, origins = format_address(options.view), options.allow_origin
            place["view"] = stack.enter_context(viewer(tap, address, port, stop, origins))
        _announce(place)
        serve(stop)


def _open_carrier(
    wire: DeviceOnLine | PacedDevice, options: Namespace, stack: contextlib.ExitStack
) -> tuple[str, _Runner]:
    """Open the port; return its name, and the function that serves it until told to stop."""
    if options.tcp:
        listener = stack.enter_context(listen_tcp(*options.tcp, remote=options.allow_remote))
        port = f"tcp://{format_address(listener.getsockname())}"
        return port, lambda stop: serve_tcp(wire, listener, stop)
    if options.usbip:
        kind = SerialFunction if options.usb_class == "cdc-acm" else DisplayFunction
        listener = stack.enter_context(listen_tcp(*options.usbip, remote=options.allow_remote))
        port = f"usbip://{format_address(listener.getsockname())}"
        return port, lambda stop: serve_usbip(UsbDevice(kind(wire)), listener, stop)
    line, port = stack.enter_context(open_pty())
    if options.link:
        stack.enter_context(symbolic_link(options.link, port))
    return port, lambda stop: serve_wire(wire, line, stop)


def _announce(place: dict[str, str]) -> None:
    """Print the first line. A stdout that cannot take it does not stop the device."""
    line = json.dumps(place)
    if sys.stdout is None:  # the process was started without one
        return
    try:
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
    except (OSError, ValueError) as error:
        _note(f"stdout: {error}; this is the port: {line}")


def _note(text: str) -> None:
    if sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.write(f"voxdisplay-sim: {printable(text)}\n")
