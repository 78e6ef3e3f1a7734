"""`Display`: frames, reading back, progress, interrupts, restarts of the device."""

import dataclasses

import document
import numpy as np
import pytest
from memory_pipe import GRID, Pipe, assert_shows, changed, open_display, payloads_of, random_frame

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.wire import packet as packets

# -- the ordinary


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
@pytest.mark.parametrize("refresh", [0, 30_000])
def test_present_read_and_clear(format_, refresh):
    display, pipe = open_display(pixel_format=format_, refresh=refresh)
    assert display.info.grid == GRID
    assert display.info.format.value == format_
    every = {"line", "box", "dots", "oct", "arc", "read", "digest", "arc2", "slabs"}
    every |= {"diff", "palette"} if format_ == "index8" else set()
    every |= {"fade", "values"} if format_ != "mono1" else set()
    every |= {"hold"} if refresh else set()
    assert set(display.info.features) == every
    for number in (1, 2):
        frame = random_frame(display, number)
        payloads = payloads_of(display, frame)
        receipt = display.present(frame)
        assert_shows(pipe, frame)
        assert receipt.frame == number
        assert receipt.digest == frame.digest()
        assert receipt.voxels == len(frame.lit()[0])
        assert receipt.packets == len(payloads)
        assert receipt.wire_bytes > sum(map(len, payloads))
        assert receipt.retransmitted == 0
        back = display.read()
        assert back.dtype == frame.array().dtype
        assert (back == frame.array()).all()
    assert (display.read(back=True) == random_frame(display, 1).array()).all()
    assert display.clear().voxels == 0
    assert not any(pipe.bench.snapshot().pixels)


def test_verify_says_where_the_page_differs():
    display, pipe = open_display()
    frame = display.frame()
    frame.draw([(1, 2, 3), (16, 8, 4)], "red")
    display.present(frame)
    display.verify(frame)
    place = int(display.info.grid.index_of(np.array([(1, 2, 3)]))[0])
    pipe.device.memory.front.stored.exchange_run(place, bytes((7, 0, 0)))  # its digest stays
    with pytest.raises(vd.DesyncError, match=r"1 voxels differ, the first at \(1, 2, 3\)"):
        display.verify(frame)


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
@pytest.mark.parametrize(
    ("place", "light", "message"),
    [
        ((1, 2, 3), False, r"1 voxels differ, the first at \(1, 2, 3\)"),
        ((2, 2, 3), True, r"1 voxels differ, the first at \(2, 2, 3\)"),
        (None, True, r"2 voxels differ, the first at \(1, 2, 3\)"),
    ],
    ids=["dark", "lit too", "moved"],
)
def test_verify_finds_what_is_dark_lit_or_moved(format_, place, light, message):
    display, pipe = open_display(pixel_format=format_)
    frame = display.frame()
    frame.draw([(1, 2, 3), (16, 8, 4)], "white")
    display.present(frame)
    front = pipe.device.memory.front.stored
    size = 3 if format_ == "rgb888" else 2 if format_ == "rgb565" else 1
    on = (b"\1" if format_ == "mono1" else b"\xff") * size
    for voxel in [place] if place else [(1, 2, 3), (2, 2, 3)]:
        lit = light and voxel != (1, 2, 3)
        index = int(display.info.grid.index_of(np.array([voxel]))[0])
        front.exchange_run(index, on if lit else bytes(size))
    with pytest.raises(vd.DesyncError, match=message):
        display.verify(frame)


def test_verify_costs_what_is_lit(monkeypatch):
    with vd.open("sim:?size=1024x1024x1024&format=rgb888") as display:
        frame = display.frame()
        frame.draw(vd.Circle((500, 500, 500), 300), "red")
        display.present(frame)
        monkeypatch.setattr(vd.Frame, "array", lambda _: pytest.fail("a dense copy was made"))
        page = display.verify(frame)
        x, y, z = frame.grid.voxels_at(frame.lit()[0][:1])[0]
        assert page[z, y, x].tolist() == [255, 0, 0]


def test_the_text_of_a_device_cannot_steer_a_terminal():
    display, _ = open_display(name="\x1b[2Jcube\r", firmware="1\n2")
    assert display.info.name == "\N{REPLACEMENT CHARACTER}[2Jcube\N{REPLACEMENT CHARACTER}"
    assert display.info.firmware.isprintable()


def test_progress_is_reported():
    display, _ = open_display()
    reports = []
    payloads = payloads_of(display, random_frame(display))
    display.present(random_frame(display), progress=lambda *place: reports.append(place))
    assert reports == sorted(reports)
    assert reports[-1][0] == reports[-1][1] == len(payloads)
    reports.clear()
    display.read(progress=lambda *place: reports.append(place))
    assert reports == sorted(reports)
    assert reports[-1] == (display.info.grid.voxels,) * 2


def test_a_frame_of_another_shape_or_format_is_refused_and_nothing_is_sent():
    display, pipe = open_display()
    before = pipe.device.taken_by_type.copy()
    for frame in (vd.Frame((3, 5, 7)), vd.Frame(GRID, "index8")):
        with pytest.raises(vd.LocalProtocolError, match="the frame is"):
            display.present(frame)
    assert pipe.device.taken_by_type == before


def test_without_waiting_the_newest_frame_wins():
    display, pipe = open_display(refresh=1000)
    frames = [random_frame(display, seed, 0.9) for seed in range(6)]
    for frame in frames:
        assert display.present(frame, wait=False) is None
    display.flush()
    assert_shows(pipe, frames[-1])
    assert pipe.device.swaps < 6
    receipt = display.present(frames[0])
    assert_shows(pipe, frames[0])
    assert receipt.frame == pipe.device.swaps


def test_no_more_than_two_frames_are_under_way():
    """A display that waits for its ticks never lags behind by what its buffer holds."""
    display, pipe = open_display(refresh=1000)
    frames = [random_frame(display, seed, 0.01) for seed in range(20)]
    for frame in frames:
        display.present(frame, wait=False)
        assert display._connection.link.backlog <= 2
    display.flush()
    assert_shows(pipe, frames[-1])


def test_polling_shows_it_in_the_end():
    display, pipe = open_display()
    frame = random_frame(display)
    display.present(frame, wait=False)
    for _ in range(50):
        display.poll()
        pipe.device.tick()
    assert_shows(pipe, frame)


def test_a_caller_that_is_away_for_long():
    display, pipe = open_display()
    for seed in range(5):
        frame = random_frame(display, seed)
        display.present(frame, wait=False)
        pipe.now += 1000.0
    display.flush()
    assert_shows(pipe, frame)


def test_a_device_without_features():
    display, _ = open_display(features=frozenset())
    assert display.present(random_frame(display)).digest is None
    with pytest.raises(vd.IncompatibleDevice, match="cannot read"):
        display.read()


def test_a_closed_display():
    display, pipe = open_display()
    with display:
        pass
    display.close()
    assert pipe.closed == 1
    for use in (display.clear, display.read, display.flush, display.poll,
                lambda: display.present(display.frame())):  # fmt: skip
        with pytest.raises(vd.LocalProtocolError, match="closed"):
            use()


# -- another device, or none


def info_with(**fields):
    return lambda packet: (
        dataclasses.replace(packet, **fields) if isinstance(packet, packets.Info) else packet
    )


@pytest.mark.parametrize(
    ("fields", "what"), [({"major": 2}, "protocol 2"), ({"format": 9}, "pixel format 9")]
)
def test_a_device_that_cannot_be_served(fields, what):
    pipe = Pipe()
    pipe.answers = changed(info_with(**fields))
    with pytest.raises(vd.IncompatibleDevice, match=what):
        open_display(pipe)
    assert pipe.closed == 1


@pytest.mark.parametrize("noise", [b"", b"login: "])
def test_nothing_answers(noise):
    pipe = Pipe()
    pipe.answers = lambda _data: noise
    with pytest.raises(vd.TransportTimeout, match="pipe:: nothing answered HELLO within 2 s"):
        open_display(pipe)
    assert pipe.closed == 1
    assert pipe.now <= 2.01


def test_a_device_that_falls_silent():
    display, pipe = open_display()
    display.clear()
    pipe.answers = lambda _data: b""
    began_s = pipe.now
    with pytest.raises(vd.TransportTimeout, match="silent"):
        display.clear()
    assert pipe.now - began_s <= 2.1


def test_a_device_that_restarts_gets_its_picture_again():
    display, pipe = open_display()
    frame = random_frame(display)
    display.present(frame)
    pipe.bench.power_cycle()
    display.present(frame)
    assert_shows(pipe, frame)
    assert display.info.boot == pipe.device.boot


@pytest.mark.parametrize(
    ("config", "what"),
    [
        ({"grid": (3, 5, 7)}, "another: 3x5x7 rgb888, it was 17x9x5 rgb888"),
        ({"pixel_format": "index8"}, "another: 17x9x5 index8"),
        ({"max_payload": 127}, "less room"),
        ({"features": frozenset({"read"})}, "came back without .*digest"),
    ],
)
def test_a_device_that_comes_back_as_another(config, what):
    display, pipe = open_display()
    given = {"grid": GRID, "pixel_format": "rgb888", "max_payload": 128, "rx_buffer": 512}
    pipe.device = Device(Config(**given | config))
    with pytest.raises(vd.IncompatibleDevice, match=what):
        display.present(random_frame(display, 1, 0.05))
    assert pipe.closed == 1
    with pytest.raises(vd.LocalProtocolError, match="closed"):
        display.clear()
    assert not any(pipe.bench.snapshot().pixels), "what was meant for the other is not sent to it"


@pytest.mark.parametrize("where", ["before_read", "before_write"])
@pytest.mark.parametrize("moment", range(6))
def test_an_interrupt_in_mid_present_leaves_it_usable(where, moment):
    display, pipe = open_display()
    left = iter(range(moment, -1, -1))

    def interrupt():
        if next(left, None) == 0:
            raise KeyboardInterrupt

    setattr(pipe, where, interrupt)
    try:
        display.present(random_frame(display, 1, 0.9))
        display.read()
    except KeyboardInterrupt:
        pass
    frame = random_frame(display, 2)
    setattr(pipe, where, lambda: None)
    assert display.present(frame).digest == frame.digest()
    assert_shows(pipe, frame)
    assert (display.read() == frame.array()).all()


@pytest.mark.parametrize("wait", [True, False])
def test_a_frame_whose_coding_is_interrupted_is_never_shown(wait):
    display, pipe = open_display()
    shown = []
    pipe.device.on_swap = lambda: shown.append(pipe.bench.snapshot().digest)
    first, broken, last = (random_frame(display, seed) for seed in range(3))
    some = broken.payloads(64)[:3]

    def coded(*_device):
        yield some
        raise KeyboardInterrupt

    def show(frame):
        display.present(frame, wait=wait)
        display.flush()

    show(first)
    broken.iter_payloads = coded
    with pytest.raises(KeyboardInterrupt):
        show(broken)
    assert display.present(last).frame == 2
    assert shown == [first.digest(), last.digest()]
    assert_shows(pipe, last)


@pytest.mark.parametrize("wait", [True, False])
def test_an_interrupt_before_anything_is_coded_leaves_no_frame_that_never_ends(wait):
    display, pipe = open_display()
    link = display._connection.link
    begin = link.open_frame

    def interrupted():
        begin()
        raise KeyboardInterrupt

    link.open_frame = interrupted
    with pytest.raises(KeyboardInterrupt):
        display.present(random_frame(display, 1), wait=wait)
    link.open_frame = begin
    turns = iter(range(99))
    pipe.before_read = lambda: next(turns)
    display.flush()
    assert link.idle
    pipe.before_read = lambda: None
    frame = random_frame(display, 2)
    display.present(frame)
    assert_shows(pipe, frame)


@pytest.mark.parametrize("moment", [0, 1, 5, -1])
def test_an_interrupt_while_a_packet_is_made_leaves_no_payload_out(monkeypatch, moment):
    display, pipe = open_display()
    first, last = random_frame(display, 1, 0.9), random_frame(display, 2)
    left = iter(range(moment % len(payloads_of(display, first)), -1, -1))
    encode = packets.encode

    def interrupted(packet):
        if isinstance(packet, packets.Data) and next(left, None) == 0:
            raise KeyboardInterrupt
        return encode(packet)

    monkeypatch.setattr(packets, "encode", interrupted)
    with pytest.raises(KeyboardInterrupt):
        display.present(first)
    display.flush()
    assert_shows(pipe, first)
    assert display.present(last).digest == last.digest()
    assert_shows(pipe, last)


def test_an_interrupted_read_does_not_disturb_the_next():
    display, _ = open_display()
    frame = random_frame(display, 1, 0.9)
    display.present(frame)

    def interrupt(*_place):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        display.read(progress=interrupt)
    display._connection.link.read(3, 4)  # as if it had been requested and not fetched
    assert (display.read() == frame.array()).all()


def test_a_device_that_breaks_the_protocol():
    display, pipe = open_display()
    pipe.answers = lambda _data: document.on_wire(bytes.fromhex("80 00 00 01"))
    with pytest.raises(vd.RemoteProtocolError, match=r"protocol.md, section 9"):
        display.clear()
    pipe.answers = lambda data: data
    display.clear()


def test_a_display_says_what_it_shows():
    display, pipe = open_display()
    assert display.digest() == 0
    frame = display.frame()
    frame.draw([(1, 2, 3)])
    display.present(frame)
    pipe.now += 1000  # a long idle time
    assert display.digest() == frame.digest() == pipe.bench.snapshot().digest
    assert display.counters.statuses >= 2
    pipe.bench.power_cycle()
    assert display.digest() == 0


def test_a_display_without_digest_says_nothing_of_what_it_shows():
    display, _ = open_display(features=frozenset({"read"}))
    assert display.digest() is None
