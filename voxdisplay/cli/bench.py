"""``voxdisplay bench``: speed of this machine and of a port, beside the raw pipe."""

from __future__ import annotations

import platform
from typing import TYPE_CHECKING, Any, Final

import click

import voxdisplay as vd
from voxdisplay.cli.options import default_port, json_option, no_reset, port_options, quiet_option
from voxdisplay.cli.output import device_json, note, plural, print_json, print_stdout, progress_bar

if TYPE_CHECKING:
    from voxdisplay.cli.bench_measurements import Coding, Generation, LinkSpeed, RawPipe
    from voxdisplay.display.baud import Baud

_STEPS: Final = 6
_MIN_REFRESHES: Final = 10  # of a frame of noise, so that waiting for one counts little


@click.command(
    epilog="""\b
    Examples:
      voxdisplay bench
      voxdisplay bench --port /dev/ttyUSB0 --baud 921600
      voxdisplay bench --port tcp://10.0.0.9:5000 --json
    """
)
@port_options
@quiet_option
@json_option
def bench(*, port: str | None, baud: Baud, timeout_s: float, as_json: bool) -> None:
    """Measure generation, coding and link speed on this machine and a port.

    Takes less than 20 seconds. The link is measured beside the raw pipe: the same port without
    packets, ACKs and drawing. Draws on the display, which is dark afterwards.
    """
    from voxdisplay.cli import bench_measurements  # noqa: PLC0415 - loads numpy
    from voxdisplay.cli.signals import close_on_exit  # noqa: PLC0415
    from voxdisplay.display.baud import open_at_rate  # noqa: PLC0415
    from voxdisplay.display.handshake import request_info  # noqa: PLC0415

    port = default_port(port)
    generations: list[Generation] = []
    codings: list[Coding] = []
    with progress_bar("measuring") as progress:
        done = 0

        def step() -> None:
            nonlocal done
            done += 1
            if progress:
                progress(done, _STEPS)

        transport = open_at_rate(port, baud, timeout_s, note, reset=not no_reset())
        try:
            greeting = request_info(transport, timeout_s)
            raw = bench_measurements.measure_raw_pipe(transport, greeting, timeout_s)
            step()
            display = vd.open(transport, timeout_s=timeout_s)
        except BaseException:
            transport.close()
            raise
        with close_on_exit(display, "blank"):
            info = display.info
            frames = []
            for name, scene in bench_measurements.scenes(info.grid):
                generation = bench_measurements.measure_generation(name, scene)
                generations.append(generation)
                step()
                frame = display.frame()
                scene.draw_each(frame)
                frames.append(frame)
                coding = bench_measurements.measure_coding(name, frame, info, raw.bytes_per_s)
                codings.append(coding)
                step()
            link = bench_measurements.measure_link(display, frames[0], raw)
            display.clear()
            step()
    if as_json:
        print_json(_facts(port, info, generations, codings, raw, link))
    else:
        print_stdout(_table(port, info, generations, codings, raw, link))


def _facts(
    port: str,
    info: vd.DeviceInfo,
    generations: list[Generation],
    codings: list[Coding],
    raw: RawPipe,
    link: LinkSpeed,
) -> dict[str, Any]:
    return {
        "machine": {"python": platform.python_version(), "system": platform.platform()},
        "generation": [
            {
                "scene": each.scene,
                "voxels": each.voxels,
                "seconds": each.seconds,
                "voxels_per_s": each.voxels / each.seconds,
            }
            for each in generations
        ],
        "coding": [
            {
                "scene": each.scene,
                "voxels": each.voxels,
                "payload_bytes": each.payload_bytes,
                "seconds": each.seconds,
                "voxels_per_s": each.voxels / each.seconds,
            }
            for each in codings
        ],
        "link": {
            "port": port,
            "device": device_json(info),
            "round_trip_s": raw.round_trip_s,
            "raw_bytes_per_s": raw.bytes_per_s,
            "bytes_per_s": link.bytes_per_s,
            "share_of_raw": link.bytes_per_s / raw.bytes_per_s,
            "wire_bytes": link.noise_bytes,
            "seconds": link.noise_s,
            "present_s": link.present_s,
        },
    }


def _table(
    port: str,
    info: vd.DeviceInfo,
    generations: list[Generation],
    codings: list[Coding],
    raw: RawPipe,
    link: LinkSpeed,
) -> str:
    rows = [f"{'generation':<14}{'voxels':>10}{'':>11}{'time':>12}{'rate':>16}"]
    rows += [
        f"  {each.scene:<12}{each.voxels:>10}{'':>11}{each.seconds * 1e3:>9.2f} ms"
        f"{each.voxels / each.seconds / 1e6:>9.2f} Mvox/s"
        for each in generations
    ]
    rows.append(f"{'coding':<14}{'voxels':>10}{'bytes':>11}{'time':>12}{'rate':>16}")
    rows += [
        f"  {each.scene:<12}{each.voxels:>10}{each.payload_bytes:>11}{each.seconds * 1e3:>9.2f} ms"
        f"{each.voxels / each.seconds / 1e6:>9.2f} Mvox/s"
        for each in codings
    ]
    noise = plural(link.noise_bytes, "byte")
    share = link.bytes_per_s / raw.bytes_per_s
    refresh = f", refresh {info.refresh_hz:g} Hz" if info.refresh_hz else ""
    rows += [
        f"link of {port}: {info.grid} {info.format.value}{refresh}",
        f"  one curve, from frame to proof {link.present_s * 1e3:>16.2f} ms",
        f"  round trip, HELLO to INFO      {raw.round_trip_s * 1e3:>16.2f} ms",
        f"  noise, {noise:<24}{link.noise_s * 1e3:>16.2f} ms{_rate(link.bytes_per_s):>16}",
        f"  raw pipe{'':<43}{_rate(raw.bytes_per_s):>15}",
        f"  the link carries {share:.0%} of the raw pipe, with coding, drawing and proof",
    ]
    if info.refresh_hz and link.noise_s * info.refresh_hz < _MIN_REFRESHES:
        rows.append("  (the share is low: on this display a frame so short waits for the refresh)")
    return "\n".join(rows)


def _rate(bytes_per_s: float) -> str:
    if bytes_per_s >= 1e6:
        return f"{bytes_per_s / 1e6:.2f} MB/s"
    return f"{bytes_per_s / 1e3:.2f} kB/s"
