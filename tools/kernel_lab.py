"""Runs the tests marked ``kernel`` in a real Linux kernel: Debian's own, in an emulated machine.

    python tools/kernel_lab.py            # all of them
    python tools/kernel_lab.py -k tty     # what comes behind goes to pytest

Needs Linux with Debian's package tools, and no root. It keeps the kernel in ``build/kernel_lab``.
The machine sees this one's files, to read only, and runs this Python in them; it has no network
but its own.
"""

from __future__ import annotations

import argparse
import contextlib
import gzip
import lzma
import re
import shlex
import shutil
import struct
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build" / "kernel_lab"
# Programs, and the packages that have them.
NEEDED = {
    "qemu-system-x86_64": "qemu-system-x86",
    "busybox": "busybox-static",
    "cpio": "cpio",
    "depmod": "kmod",
    "modprobe": "kmod",
    "dpkg-deb": "dpkg",
    "apt-get": "apt",
}
# virtio and 9p for the files, vhci for USB over TCP, cdc-acm for /dev/ttyACM0.
MODULES = ("virtio_pci", "9pnet_virtio", "9p", "vhci-hcd", "cdc-acm")
DEADLINE_S = 1200
_MARK = "kernel_lab: exit code"

INIT = """\
#!/bin/busybox sh
/bin/busybox mkdir -p /proc /sys /dev /host
/bin/busybox mount -t proc proc /proc
/bin/busybox mount -t sysfs sys /sys
/bin/busybox mount -t devtmpfs dev /dev
for module in {modules}; do /bin/busybox insmod /modules/$module || echo "no $module"; done
/bin/busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288,cache=loose,ro host /host
for place in proc sys dev; do /bin/busybox mount --rbind /$place /host/$place; done
/bin/busybox mkdir -p /dev/pts /dev/shm
/bin/busybox mount -t devpts pts /host/dev/pts
/bin/busybox mount -t tmpfs tmp /host/dev/shm
/bin/busybox ip link set lo up
echo "kernel_lab: $(/bin/busybox uname -rv)"
cd /
/bin/busybox chroot /host /bin/sh -c {command}
echo "{mark} $?"
/bin/busybox poweroff -f
"""


def main() -> int:
    """Set up what is missing and run the tests; return pytest's exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--setup", action="store_true", help="only fetch and build")
    options, pytest_arguments = parser.parse_known_args()
    missing = sorted({pack for name, pack in NEEDED.items() if not _which(name)})
    if missing:
        print("missing; as root: apt-get install --no-install-recommends " + " ".join(missing))
        return 2
    kernel = _kernel()
    if options.setup:
        return 0
    command = [sys.executable, "-m", "pytest", "-m", "kernel", "-p", "no:cacheprovider"]
    command += ["-p", "no:hypothesispytest", "--tb=short", "--color=no", *pytest_arguments]
    command += [str(path) for path in sorted(ROOT.glob("tests/**/test_*.py")) if _has_mark(path)]
    settings = "TMPDIR=/dev/shm HOME=/dev/shm PYTHONDONTWRITEBYTECODE=1 TEST_PATIENCE=10"
    line = f"cd {shlex.quote(str(ROOT))} && export {settings} && exec {shlex.join(command)}"
    return _run(kernel, _initrd(line))


def _has_mark(path: Path) -> bool:
    return "mark.kernel" in path.read_text(encoding="utf-8")


def _which(name: str) -> str | None:
    return shutil.which(name, path="/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin")


def _kernel() -> Path:
    """Return the path of the unpacked kernel image; fetch Debian's if there is none."""
    BUILD.mkdir(parents=True, exist_ok=True)
    image = BUILD / "vmlinux"
    if image.exists():
        return image
    depends = _output("apt-cache", "depends", "linux-image-amd64")
    found = re.search(r"Depends: (linux-image-\S+)", depends)
    if not found:
        sys.exit("apt knows no kernel: run apt-get update as root first")
    print(f"kernel_lab: fetching {found[1]}, about 70 MB", flush=True)
    subprocess.run(["apt-get", "download", "-qq", found[1]], cwd=BUILD, check=True)  # noqa: S607
    package = max(BUILD.glob("linux-image-*.deb"))
    subprocess.run(["dpkg-deb", "-x", package, BUILD / "root"], check=True)  # noqa: S607
    package.unlink()
    subprocess.run([_which("depmod") or "", "-b", BUILD / "root", _version()], check=True)
    (boot,) = (BUILD / "root" / "boot").glob("vmlinuz-*")
    image.write_bytes(_unpacked(boot.read_bytes()))
    return image


def _version() -> str:
    (modules,) = (BUILD / "root" / "lib" / "modules").iterdir()
    return modules.name


def _unpacked(image: bytes) -> bytes:
    """Take the kernel proper out of a bzImage, which saves the machine ten seconds of unpacking.

    Its place stands in the boot header: Documentation/arch/x86/boot.rst.
    """
    sectors = image[0x1F1] or 4
    offset, length = struct.unpack_from("<II", image, 0x248)
    start = (sectors + 1) * 512 + offset
    packed = image[start : start + length]
    if packed.startswith(b"\x1f\x8b"):
        return gzip.decompress(packed[:-4])
    return lzma.LZMADecompressor().decompress(packed)


def _initrd(command: str) -> Path:
    """Build the initial RAM file system: busybox, modules and a script."""
    work = BUILD / "initrd"
    shutil.rmtree(work, ignore_errors=True)
    for folder in ("bin", "modules"):
        (work / folder).mkdir(parents=True)
    shutil.copy(_which("busybox") or "", work / "bin" / "busybox")
    names = []
    for module in MODULES:
        for path in _module_files(module):
            if path.name not in names:
                names.append(path.name)
                shutil.copy(path, work / "modules")
    init = work / "init"
    init.write_text(INIT.format(modules=" ".join(names), command=shlex.quote(command), mark=_MARK))
    init.chmod(0o755)
    files = "\n".join(str(path.relative_to(work)) for path in work.rglob("*"))
    packed = subprocess.run(
        [_which("cpio") or "", "-o", "-H", "newc", "--quiet"],
        cwd=work,
        input=files.encode(),
        capture_output=True,
        check=True,
    ).stdout
    initrd = BUILD / "initrd.cpio"
    initrd.write_bytes(packed)
    return initrd


def _module_files(module: str) -> list[Path]:
    """Return the file of a kernel module, after those of its dependencies."""
    told = _output(
        *(_which("modprobe") or "", "-d", str(BUILD / "root")),
        *("-S", _version(), "--show-depends", module),
    )
    return [Path(line.split()[1]) for line in told.splitlines() if line.startswith("insmod")]


def _output(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def _run(kernel: Path, initrd: Path) -> int:
    """Boot the machine and print its console; return the exit code of what ran in it."""
    append = "console=ttyS0 quiet panic=-1 tsc=reliable no_timer_check"
    share = "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"
    command = [
        *("qemu-system-x86_64", "-M", "pc", "-accel", "tcg", "-cpu", "max", "-m", "1024"),
        *("-nodefaults", "-nographic", "-no-reboot", "-serial", "stdio"),
        *("-kernel", str(kernel), "-initrd", str(initrd), "-append", append),
        *("-fsdev", share, "-device", "virtio-9p-pci,fsdev=host,mount_tag=host"),
    ]
    code = 3
    began_s = time.monotonic()
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, errors="replace"
    ) as machine:
        assert machine.stdout is not None  # noqa: S101 - it is a pipe
        with contextlib.ExitStack() as stack:
            stack.callback(machine.kill)
            watchdog = subprocess.Popen(  # ends it if it hangs, whatever we are doing
                [sys.executable, "-c", _WATCH, str(machine.pid), str(DEADLINE_S)]
            )
            stack.callback(watchdog.wait)
            stack.callback(watchdog.kill)
            for line in machine.stdout:
                if line.startswith(_MARK):
                    code = int(line.removeprefix(_MARK))
                else:
                    print(line, end="", flush=True)
    print(f"kernel_lab: {time.monotonic() - began_s:.0f} s, exit code {code}")
    return code


_WATCH = """
import os, signal, sys, time
time.sleep(float(sys.argv[2]))
os.kill(int(sys.argv[1]), signal.SIGKILL)
"""

if __name__ == "__main__":
    sys.exit(main())
