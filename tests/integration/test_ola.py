"""Art-Net, sACN and OPC against OLA: what its universes hold is what was drawn."""

import time

import numpy as np
import pytest

import voxdisplay as vd

pytest.importorskip("pwd", reason="OLA runs on POSIX systems")
import olad

# 512 LEDs are four universes of Art-Net and sACN, 280 are two channels of OPC.
PORTS = {
    "artnet": "artnet://127.0.0.1?size=8x8x8",
    "sacn": "sacn://127.0.0.1?size=8x8x8&universe=101",
    "opc": "opc://127.0.0.1:{opc}?size=5x7x8&pixels=170",
}


@pytest.fixture(scope="module")
def ola():
    with olad.only_one():
        if reason := olad.reason_to_skip():
            pytest.skip(reason)
        daemon = olad.Olad()
        yield daemon
        daemon.close()


def pictures(grid, count):
    rng = np.random.default_rng(5)
    # 1 to 255: each frame changes each slot, so that OLA reports each.
    return rng.integers(1, 256, (count, *grid.array_shape, 3), dtype=np.uint8)


@pytest.mark.parametrize("scheme", PORTS)
def test_single_frames_are_what_the_universes_hold(ola, scheme):
    universes = olad.UNIVERSES[scheme][:4]
    with (
        ola.recording(universes) as frames,
        vd.open(PORTS[scheme].format(opc=ola.opc_port)) as display,
    ):
        rgb = pictures(display.info.grid, 1)[0]
        frame = display.frame()
        frame.set(rgb)
        display.present(frame)
        found = frames(1)
    held = b"".join(found[universe][-1] for universe in universes)
    assert held[: rgb.size] == rgb.tobytes()
    assert set(held[rgb.size :]) <= {0}


@pytest.mark.parametrize("scheme", ["artnet", "sacn"])
def test_sixty_frames_at_thirty_a_second_arrive(ola, scheme):
    universes = olad.UNIVERSES[scheme][:4]
    with ola.recording(universes) as frames, vd.open(PORTS[scheme]) as display:
        shown = pictures(display.info.grid, 60)
        frame = display.frame()
        begin = display.clock(fps=30, seconds=60)  # as many as there are: a late one is none less
        for rgb, _ in zip(shown, begin, strict=False):
            frame.set(rgb)
            display.present(frame)
        found = frames(60)
    for place, universe in enumerate(universes):
        slots = slice(510 * place, 510 * (place + 1))
        expected = [rgb.tobytes()[slots] for rgb in shown]
        assert [each[: len(expected[0])] for each in found[universe]] == expected


def test_a_cube_of_32_fills_193_universes(ola):
    """They are heard twenty at a time: the others have numbers that OLA does not listen to."""
    heard, held = olad.UNIVERSES["sacn"], b""
    with ola.recording(heard) as frames:
        for turn, first in enumerate(range(0, 193, len(heard))):
            before = f"1000-{999 + first}," if first else ""
            universes = f"{before}{heard[0]}-{heard[-1]}"
            with vd.open(f"sacn://127.0.0.1?size=32x32x32&universe={universes}") as display:
                rgb = pictures(display.info.grid, 1)[0]
                frame = display.frame()
                frame.set(rgb)
                assert display.present(frame).packets == 194
            awaited = heard[: 193 - first]
            found = frames(turn + 1, awaited)
            held += b"".join(found[universe][turn] for universe in awaited)
    assert held == rgb.tobytes()


def test_pushes_of_two_programs_replace_each_other(ola):
    """The second is neither dropped by its sequence number nor merged with the first."""
    universes = olad.UNIVERSES["sacn"][:1]
    with ola.recording(universes) as frames:
        for number, value in enumerate((200, 100), 1):
            with vd.open(PORTS["sacn"]) as display:
                frame = display.frame()
                frame.set(np.full((8, 8, 8, 3), value, dtype=np.uint8))
                display.present(frame)
            found = frames(number)
            time.sleep(0.1)
    assert [found[101][0][0], found[101][-1][0]] == [200, 100]
