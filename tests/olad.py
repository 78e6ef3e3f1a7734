"""OLA's daemon as a receiver: Art-Net, sACN and OPC into universes that a client of OLA records."""

import contextlib
import fcntl
import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

DEADLINE_S = 30
# Linux lets a socket join 20 multicast groups, and OLA joins one for each universe of sACN.
UNIVERSES = {"artnet": range(4), "sacn": range(101, 121), "opc": range(401, 403)}
_RPC = 9010  # that of its clients cannot be changed
_PLUGINS = (
    "dmx4linux", "dummy", "espnet", "ftdidmx", "gpio", "karate", "kinet", "milinst", "nanoleaf",
    "opendmx", "osc", "pathport", "renard", "sandnet", "shownet", "spi", "spidmx", "stageprofi",
    "uartdmx", "usbdmx", "usbpro", "usbserial",
)  # fmt: skip


@contextlib.contextmanager
def only_one():
    """Wait for other processes that test with OLA: there can be one daemon on a machine."""
    with (Path(tempfile.gettempdir()) / "voxdisplay-tests-olad.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def reason_to_skip():
    """Why OLA cannot be tested here; None if it can."""
    for program in ("olad", "ola_recorder"):
        if shutil.which(program) is None:
            return f"there is no {program}: apt-get install ola"
    for kind, number in (
        (socket.SOCK_STREAM, _RPC), (socket.SOCK_DGRAM, 6454), (socket.SOCK_DGRAM, 5568),
    ):  # fmt: skip
        with socket.socket(socket.AF_INET, kind) as placeholder:
            placeholder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                placeholder.bind(("127.0.0.1", number))
            except OSError:
                return f"port {number} is in use, and OLA's cannot be changed"
    return None


class Olad:
    """A running daemon."""

    def __init__(self):
        self._scratch = tempfile.TemporaryDirectory(prefix="olad-")  # not below root's own
        self.folder = Path(self._scratch.name)
        # OLA refuses to run as root.
        self._user = pwd.getpwnam("nobody") if os.getuid() == 0 else None
        with socket.create_server(("127.0.0.1", 0)) as placeholder:
            self.opc_port = placeholder.getsockname()[1]
        self._configure()
        self._process = self._start("olad", "-c", self.folder, "--no-http",
                                    "--no-register-with-dns-sd", "-l", "0")  # fmt: skip
        try:
            for number in (_RPC, self.opc_port):
                self._await_listener(number)
        except BaseException:
            self.close()
            raise

    def _configure(self):
        for plugin in _PLUGINS:
            self._write(f"ola-{plugin}.conf", "enabled = false")
        self._write("ola-artnet.conf", "enabled = true", "ip = 127.0.0.1")
        self._write(
            "ola-e131.conf",
            "enabled = true",
            "ip = 127.0.0.1",
            f"input_ports = {len(UNIVERSES['sacn'])}",
        )
        server = f"127.0.0.1:{self.opc_port}"
        self._write(
            "ola-openpixelcontrol.conf", "enabled = true", f"listen = {server}",
            f"listen_{server}_channel = 1", f"listen_{server}_channel = 2",
        )  # fmt: skip
        self._write(
            "ola-port.conf",
            *(f"2-1-I-{port} = {universe}" for port, universe in enumerate(UNIVERSES["artnet"])),
            *(f"11-1-I-{port} = {universe}" for port, universe in enumerate(UNIVERSES["sacn"])),
            *(f"21-{server}-I-{n} = {universe}" for n, universe in enumerate(UNIVERSES["opc"], 1)),
        )
        self._own(self.folder)

    def _write(self, name, *lines):
        (self.folder / name).write_text("\n".join(lines) + "\n")
        self._own(self.folder / name)

    def _own(self, path):
        """Give a file to the user that OLA runs as."""
        if self._user:
            os.chown(path, self._user.pw_uid, self._user.pw_gid)

    def _start(self, *command):
        user = {}
        if self._user:
            user = {"user": self._user.pw_uid, "group": self._user.pw_gid, "extra_groups": []}
        return subprocess.Popen(
            list(map(str, command)), cwd=self.folder, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, **user,
        )  # fmt: skip

    def _await_listener(self, number):
        deadline_s = time.monotonic() + DEADLINE_S
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", number)):
                return
            assert self._process.poll() is None, "olad has ended"
            assert time.monotonic() < deadline_s, "olad does not listen"
            time.sleep(0.05)

    @contextlib.contextmanager
    def recording(self, universes):
        """Record universes; yield a function that waits until each has so many frames.

        It returns, for each universe, the lists of slots in the order in which they came.
        """
        path = self.folder / f"recorded-{time.monotonic_ns()}"
        recorder = self._start("ola_recorder", "-r", path, "-u", ",".join(map(str, universes)))
        time.sleep(0.7)  # it has no way to tell that it listens

        def frames(count, awaited=universes):
            deadline_s = time.monotonic() + DEADLINE_S
            while True:
                found = _recorded(path, universes)
                enough = all(len(found[each]) >= count for each in awaited)
                if enough or time.monotonic() > deadline_s:
                    return found
                time.sleep(0.1)

        try:
            yield frames
        finally:
            recorder.send_signal(signal.SIGINT)
            recorder.wait(DEADLINE_S)

    def close(self):
        self._process.terminate()
        self._process.wait(DEADLINE_S)
        self._scratch.cleanup()


def _recorded(path, universes):
    found = {universe: [] for universe in universes}
    if not path.exists():
        return found
    # The last line may be half written.
    for line in path.read_text().split("\n")[:-1]:
        universe, _, slots = line.partition(" ")
        if slots and universe.isdigit():
            found[int(universe)].append(bytes(map(int, slots.split(","))))
    return found
