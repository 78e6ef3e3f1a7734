"""Entry point of ``voxdisplay-sim``: signals are handled before anything else is imported.

A signal during the imports ends the program like one later: cleanly, with exit code 0.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Iterator

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # not all systems have the last one


def main(argv: list[str] | None = None) -> int:
    """Run the program.

    Parameters
    ----------
    argv
        Arguments; None for those of the process.

    Returns
    -------
    int
        Exit code: 0 after SIGINT, SIGTERM or SIGHUP. Bad arguments, and ports and files that cannot
        be opened, exit with 2.
    """
    with _stop_on_signal() as stop:
        from firmware_sim.command_line import run  # noqa: PLC0415 - after the signal handlers

        return run(argv, stop)


@contextlib.contextmanager
def _stop_on_signal() -> Iterator[int]:
    """Yield a file descriptor that becomes readable at the first signal to stop."""
    stop, stopper = os.pipe()
    os.set_blocking(stopper, False)  # a pipe full of signals says enough

    def request_stop(*_: object) -> None:
        with contextlib.suppress(BlockingIOError):
            os.write(stopper, b"\0")

    signals = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    # A program that runs under nohup outlives its terminal.
    signals = [
        each
        for each in signals
        if each.name != "SIGHUP" or signal.getsignal(each) != signal.SIG_IGN
    ]
    handlers = [signal.signal(each, request_stop) for each in signals]
    try:
        yield stop
    finally:
        for each, handler in zip(signals, handlers, strict=True):
            signal.signal(each, handler)
        os.close(stop)
        os.close(stopper)


if __name__ == "__main__":
    sys.exit(main())
