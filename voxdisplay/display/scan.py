"""Asking at many ports at once who is there. Knows ports and HELLO; knows no frames."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from typing import TypeAlias

from voxdisplay.display.baud import ALL_RATES_S, Baud, open_at_rate
from voxdisplay.display.device_info import DeviceInfo, device_info
from voxdisplay.display.handshake import request_info
from voxdisplay.errors import VoxDisplayError

ProbeResult: TypeAlias = DeviceInfo | str  # who is there, or why nobody is


def probe_ports(
    ports: Iterable[str], *, baud: Baud, timeout_s: float, slack_s: float
) -> dict[str, ProbeResult]:
    """Ask at all ports at once who is there.

    Parameters
    ----------
    ports : iterable of str
    baud : int or "auto"
        Bits per second of serial lines; ``"auto"``: the fastest at which each answers.
    timeout_s : float
        How long to ask.
    slack_s : float
        How much longer opening a port may take, besides the time to try all rates.

    Returns
    -------
    dict of str to DeviceInfo or str
        What each device says of itself, or what is wrong, in the order of the ports.

    """
    answers: dict[str, ProbeResult] = dict.fromkeys(ports, "it could not be opened in time")

    def ask(port: str) -> None:
        try:
            answers[port] = _probe(port, baud, timeout_s)
        except VoxDisplayError as error:
            answers[port] = str(error)

    # One that hangs in the system's call must not keep the program.
    askers = [threading.Thread(target=ask, args=(port,), daemon=True) for port in answers]
    for asker in askers:
        asker.start()
    end_s = time.monotonic() + timeout_s + slack_s + (ALL_RATES_S if baud == "auto" else 0.0)
    for asker in askers:
        asker.join(max(0.0, end_s - time.monotonic()))
    return dict(answers)


def _probe(port: str, baud: Baud, timeout_s: float) -> DeviceInfo:
    transport = open_at_rate(port, baud, timeout_s)
    try:
        return device_info(request_info(transport, timeout_s))
    finally:
        transport.close()
