"""Identification of the devices at many ports at once. Must not know frames."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from typing import TypeAlias

from voxdisplay.display.baud import ALL_RATES_S, Baud, open_at_rate
from voxdisplay.display.device_info import DeviceInfo, device_info
from voxdisplay.display.handshake import request_info
from voxdisplay.errors import VoxDisplayError

ProbeResult: TypeAlias = DeviceInfo | str  # the device that answered, or why none did


def probe_ports(
    ports: Iterable[str], *, baud: Baud, timeout_s: float, slack_s: float, reset: bool = True
) -> dict[str, ProbeResult]:
    """Return which device answers HELLO at each of many ports.

    Parameters
    ----------
    ports : iterable of str
    baud : int or "auto"
        Bits per second of serial lines; ``"auto"``: the fastest at which each answers.
    timeout_s : float
        How long to send HELLO.
    slack_s : float
        How much longer opening a port may take, besides the time to try all rates.
    reset : bool
        See `open_transport`.

    Returns
    -------
    dict of str to DeviceInfo or str
        The device, or the reason why none answered, in the order of the ports.

    """
    results: dict[str, ProbeResult] = dict.fromkeys(ports, "it could not be opened in time")

    def probe(port: str) -> None:
        try:
            results[port] = _probe(port, baud, timeout_s, reset=reset)
        except VoxDisplayError as error:
            results[port] = str(error)

    # Daemons, because a thread that hangs in a system call must not keep the program alive.
    threads = [threading.Thread(target=probe, args=(port,), daemon=True) for port in results]
    for thread in threads:
        thread.start()
    end_s = time.monotonic() + timeout_s + slack_s + (ALL_RATES_S if baud == "auto" else 0.0)
    for thread in threads:
        thread.join(max(0.0, end_s - time.monotonic()))
    return dict(results)


def _probe(port: str, baud: Baud, timeout_s: float, *, reset: bool) -> DeviceInfo:
    transport = open_at_rate(port, baud, timeout_s, reset=reset)
    try:
        return device_info(request_info(transport, timeout_s))
    finally:
        transport.close()
