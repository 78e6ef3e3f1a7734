"""A display over a pipe in memory, with an emulated device at its end. The clock is the pipe's."""

import dataclasses

import document
import numpy as np
import pytest

import voxdisplay as vd
from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec
from voxdisplay.wire.stream import PacketStream

GRID = (17, 9, 5)


class Pipe:
    """A transport: bytes arrive at once, waiting for what does not come takes virtual time."""

    port = "pipe:"

    def __init__(self, **config):
        config = {"grid": GRID, "pixel_format": "rgb888", "refresh": 30_000} | config
        self.device = Device(Config(max_payload=128, rx_buffer=512, **config))
        self.bench = Bench(self.device)
        self.now = 0.0
        self.closed = 0
        self.answers = lambda data: data  # what becomes of what the device says
        self.before_write = self.before_read = lambda: None

    def read(self, timeout_s):
        self.before_read()
        data = self.device.transmit()
        if not data and timeout_s:
            self.now += timeout_s
            self.device.tick()
            data = self.device.transmit()
        return self.answers(data)

    def write(self, data, timeout_s):
        assert timeout_s > 0
        self.before_write()
        self.device.receive(data)

    def close(self):
        self.closed += 1


@pytest.fixture
def opened():
    """Open a display on a new device: (display, pipe)."""

    def open_on(pipe=None, **config):
        pipe = pipe or Pipe(**config)
        return vd.open(pipe, timeout_s=2.0, clock=lambda: pipe.now), pipe

    return open_on


def random_frame(display, seed=0, density=0.3):
    rng = np.random.default_rng(seed)
    frame = display.frame()
    array = frame.array()
    lit = rng.random(array.shape[:3]) < density
    array[lit] = rng.integers(1, 256 if frame.format.value != "mono1" else 2, array[lit].shape)
    frame.set(array)
    return frame


def payloads_of(display, frame):
    return frame.payloads(display._connection.link.payload_bytes, display.info.features)


def assert_shows(pipe, frame):
    assert pipe.bench.snapshot().pixels == frame.array().tobytes()


def changed(change):
    """An ``answers`` that changes some packets of the device."""
    stream = PacketStream()
    return lambda data: b"".join(packets.encode(change(packet)) for packet in stream.feed(data))


# -- the ordinary


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
@pytest.mark.parametrize("refresh", [0, 30_000])
def test_present_read_and_clear(opened, format_, refresh):
    display, pipe = opened(pixel_format=format_, refresh=refresh)
    assert display.info.grid == GRID
    assert display.info.format.value == format_
    every = {"line", "box", "dots", "oct", "arc", "read", "digest"}
    every |= {"diff", "palette"} if format_ == "index8" else set()
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


def test_verify_says_where_the_page_differs(opened):
    display, pipe = opened()
    frame = display.frame()
    frame.draw([(1, 2, 3), (16, 8, 4)], "red")
    display.present(frame)
    display.verify(frame)
    pipe.device.memory.front.pixels[3 * display.info.grid.index_of(np.array([(1, 2, 3)]))[0]] = 7
    with pytest.raises(vd.DesyncError, match=r"1 voxels differ, the first at \(1, 2, 3\)"):
        display.verify(frame)


def test_the_text_of_a_device_cannot_steer_a_terminal(opened):
    display, _ = opened(name="\x1b[2Jcube\r", firmware="1\n2")
    assert display.info.name == "\N{REPLACEMENT CHARACTER}[2Jcube\N{REPLACEMENT CHARACTER}"
    assert display.info.firmware.isprintable()


def test_progress_is_told(opened):
    display, _ = opened()
    told = []
    payloads = payloads_of(display, random_frame(display))
    display.present(random_frame(display), progress=lambda *place: told.append(place))
    assert told == sorted(told)
    assert told[-1][0] == told[-1][1] == len(payloads)
    told.clear()
    display.read(progress=lambda *place: told.append(place))
    assert told == sorted(told)
    assert told[-1] == (display.info.grid.voxels,) * 2


def test_a_frame_of_another_shape_or_format_is_refused_and_nothing_is_sent(opened):
    display, pipe = opened()
    before = pipe.device.taken.copy()
    for frame in (vd.Frame((3, 5, 7)), vd.Frame(GRID, "index8")):
        with pytest.raises(vd.LocalProtocolError, match="the frame is"):
            display.present(frame)
    assert pipe.device.taken == before


def test_without_waiting_the_newest_frame_wins(opened):
    display, pipe = opened(refresh=1000)
    frames = [random_frame(display, seed, 0.9) for seed in range(6)]
    for frame in frames:
        assert display.present(frame, wait=False) is None
    display.flush()
    assert_shows(pipe, frames[-1])
    assert pipe.device.swaps < 6
    receipt = display.present(frames[0])
    assert_shows(pipe, frames[0])
    assert receipt.frame == pipe.device.swaps


def test_no_more_than_two_frames_are_under_way(opened):
    """A display that waits for its ticks never lags behind by what its buffer holds."""
    display, pipe = opened(refresh=1000)
    frames = [random_frame(display, seed, 0.01) for seed in range(20)]
    for frame in frames:
        display.present(frame, wait=False)
        assert display._connection.link.backlog <= 2
    display.flush()
    assert_shows(pipe, frames[-1])


def test_polling_shows_it_in_the_end(opened):
    display, pipe = opened()
    frame = random_frame(display)
    display.present(frame, wait=False)
    for _ in range(50):
        display.poll()
        pipe.device.tick()
    assert_shows(pipe, frame)


def test_a_caller_that_is_away_for_long(opened):
    display, pipe = opened()
    for seed in range(5):
        frame = random_frame(display, seed)
        display.present(frame, wait=False)
        pipe.now += 1000.0
    display.flush()
    assert_shows(pipe, frame)


def test_a_device_without_features(opened):
    display, _ = opened(features=frozenset())
    assert display.present(random_frame(display)).digest is None
    with pytest.raises(vd.IncompatibleDevice, match="cannot read"):
        display.read()


def test_a_closed_display(opened):
    display, pipe = opened()
    with display:
        pass
    display.close()
    assert pipe.closed == 1
    for use in (display.clear, display.read, display.flush, display.poll,
                lambda: display.present(display.frame())):  # fmt: skip
        with pytest.raises(vd.LocalProtocolError, match="closed"):
            use()


# -- what is on display already


def flags_sent(pipe):
    """A list that grows by the flags of each DATA packet."""
    flags, write = [], pipe.write

    def noting(data, timeout_s):
        for body in document.off_wire(data.replace(b"\0\0", b"\0").lstrip(b"\0")):
            flags.extend([body[0] & 15] if body[0] >> 4 == spec.TYPE_DATA else [])
        write(data, timeout_s)

    pipe.write = noting
    return flags


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
def test_a_frame_that_keeps_what_is_on_display(opened, format_):
    display, pipe = opened(pixel_format=format_)
    before = random_frame(display)
    whole = display.present(before)
    flags = flags_sent(pipe)
    frame = display.frame(keep=True)
    assert (frame.array() == before.array()).all()
    frame.draw([(x, 1, 2) for x in range(17)], "red")
    frame.draw([(3, 3, 3)], "black")
    receipt = display.present(frame)
    assert_shows(pipe, frame)
    assert receipt.digest == frame.digest()
    assert receipt.wire_bytes < whole.wire_bytes / 3
    assert flags == [spec.DATA_FLAG_COMMIT]


def test_any_frame_that_differs_little_goes_as_its_difference(opened):
    display, pipe = opened()
    frame = random_frame(display)
    display.present(frame)
    flags = flags_sent(pipe)
    array = frame.array()
    array[2, 3, 4] ^= 255
    again = display.frame()
    again.set(array)
    display.present(again)
    assert_shows(pipe, again)
    display.present(again)
    assert flags == [spec.DATA_FLAG_COMMIT] * 2
    for wait in (True, False):
        display.present(random_frame(display, 1 + wait), wait=wait)
        assert flags.pop() & spec.DATA_FLAG_CLEAR


def test_without_waiting_too(opened):
    display, pipe = opened()
    frame = random_frame(display)
    display.present(frame, wait=False)
    kept = display.frame(keep=True)
    assert (kept.array() == frame.array()).all()
    flags = flags_sent(pipe)
    kept.draw([(3, 3, 3)], "lime")
    display.present(kept, wait=False)
    kept.draw([(4, 4, 4)], "lime")  # what was handed over stays as it was
    display.flush()
    kept.draw([(4, 4, 4)], "black")
    assert flags == [spec.DATA_FLAG_COMMIT]
    assert pipe.bench.snapshot().digest != frame.digest()


def test_a_device_that_restarts_is_not_asked_to_keep_anything(opened):
    display, pipe = opened()
    display.present(random_frame(display))
    frame = display.frame(keep=True)
    frame.draw([(3, 3, 3)], "lime")
    pipe.bench.power_cycle()
    display.present(frame)
    assert_shows(pipe, frame)
    pipe.bench.power_cycle()
    display.present(frame, wait=False)
    display.flush()
    assert_shows(pipe, frame)


def test_what_another_has_shown_is_read_back(opened):
    first, pipe = opened()
    shown = random_frame(first)
    first.present(shown)
    display, _ = opened(pipe)
    frame = display.frame(keep=True)
    assert (frame.array() == shown.array()).all()
    frame.draw([(3, 3, 3)], "lime")
    flags = flags_sent(pipe)
    display.present(frame)
    assert_shows(pipe, frame)
    assert flags == [spec.DATA_FLAG_COMMIT]


@pytest.mark.parametrize("features", [frozenset(), frozenset({"digest"}), frozenset({"read"})])
def test_what_is_not_known_is_not_made_up(opened, features):
    display, pipe = opened(features=features)
    if "read" not in features:
        with pytest.raises(vd.IncompatibleDevice, match="not known what is on display") as caught:
            display.frame(keep=True)
        assert "whole frame first" in caught.value.hint
    frame = random_frame(display)
    display.present(frame)
    if features:
        assert (display.frame(keep=True).array() == frame.array()).all()
    else:
        with pytest.raises(vd.IncompatibleDevice, match="not known"):
            display.frame(keep=True)
    display.present(frame)
    assert_shows(pipe, frame)


def test_a_difference_that_does_not_take_is_mended_by_the_whole(opened):
    display, pipe = opened()
    display.present(random_frame(display))
    pipe.device.memory.front.put(7, b"\x01\x02\x03")  # and nobody has noticed
    frame = display.frame(keep=True)
    frame.draw([(3, 3, 3)], "lime")
    display.present(frame)
    assert_shows(pipe, frame)
    assert display.present(frame).digest == frame.digest()


def test_a_palette_needs_a_device_that_takes_one(opened):
    display, _ = opened(pixel_format="index8", features=frozenset({"diff", "digest"}))
    palette = display.frame().palette
    with pytest.raises(vd.IncompatibleDevice, match="no palette"):
        display.frame(palette=palette)
    display.present(display.frame())
    palette[1] = 77
    with pytest.raises(vd.LocalProtocolError, match="palette of its own"):
        display.present(vd.Frame(GRID, "index8", palette=palette))
    with pytest.raises(ValueError, match="keeps its palette"):
        display.frame(keep=True, palette=palette)


def test_a_palette_of_its_own(opened):
    features = frozenset({"palette", "read", "digest"})
    display, pipe = opened(pixel_format="index8", features=features)
    frame = display.frame()
    assert frame.draw([(x, 1, 2) for x in range(17)], ["#123456", "#abcdef"]).exact_color
    display.present(frame)
    assert_shows(pipe, frame)
    flags = flags_sent(pipe)
    kept = display.frame(keep=True)
    assert (kept.rgb() == frame.rgb()).all()
    assert kept.draw([(3, 4, 1)], "#777777").exact_color
    assert display.present(kept).digest == kept.digest()
    assert flags == [spec.DATA_FLAG_COMMIT]
    given = display.frame(palette=kept.palette)
    given.set(kept.array())
    display.present(given)
    other, _ = opened(pipe)
    assert other.frame(keep=True).draw([(0, 0, 0)], "#010203").exact_color
    assert other.clear().digest == 0


# -- what is not shown as it was meant


def test_a_page_that_differs_once_is_repaired(opened):
    display, pipe = opened()
    frame = random_frame(display)

    def disturb():
        pipe.device.on_swap = lambda: None
        pipe.device.memory.front.put(7, b"\x01\x02\x03")

    pipe.device.on_swap = disturb
    receipt = display.present(frame)
    assert receipt.digest == frame.digest()
    assert "1 voxels differ" in receipt.repaired
    assert_shows(pipe, frame)
    assert pipe.device.swaps == 2
    assert display.present(frame).repaired is None


@pytest.mark.parametrize("newer", [False, True])
def test_a_page_that_differs_once_is_repaired_without_waiting_too(opened, newer):
    display, pipe = opened()
    shown = []

    def disturb():
        shown.append(pipe.bench.snapshot().digest)
        if len(shown) == 1:
            pipe.device.memory.front.put(7, b"\x01\x02\x03")
            if newer:
                display.present(last, wait=False)

    first, last = random_frame(display, 1), random_frame(display, 2)
    pipe.device.on_swap = disturb
    display.present(first, wait=False)
    display.flush()
    frame = last if newer else first
    assert_shows(pipe, frame)
    assert shown == [first.digest(), frame.digest()]
    assert display.present(first).frame == len(set(shown)) + 1


def test_a_page_that_differs_again_and_again(opened):
    display, pipe = opened()
    pipe.device.on_swap = lambda: pipe.device.memory.front.put(17, b"\x01\x02\x03")
    with pytest.raises(vd.DesyncError, match=r"1 voxels differ, the first at \(0, 1, 0\)"):
        display.present(random_frame(display))
    pipe.device.on_swap = lambda: None
    display.present(random_frame(display))


def test_where_a_page_of_numbers_differs(opened):
    display, pipe = opened(pixel_format="index8")
    pipe.device.on_swap = lambda: pipe.device.memory.front.put(3 + 17 * 2, b"\x07")
    with pytest.raises(vd.DesyncError, match=r"first at \(3, 2, 0\): 7 instead of 0"):
        display.present(display.frame())


@pytest.mark.parametrize("features", [frozenset({"digest"}), frozenset({"digest", "read"})])
def test_a_digest_that_lies(opened, features):
    display, pipe = opened(features=features)

    def lie(packet):
        if isinstance(packet, packets.Ack):
            return dataclasses.replace(packet, digest=packet.digest ^ 1)
        return packet

    pipe.answers = changed(lie)
    with pytest.raises(vd.DesyncError, match="digest") as caught:
        display.present(random_frame(display))
    assert ("reads back as it was meant" in str(caught.value)) == ("read" in features)
    display.present(random_frame(display), wait=False)
    with pytest.raises(vd.DesyncError, match="digest"):
        display.flush()


def test_a_refused_packet_and_then_another(opened):
    display, pipe = opened()
    for _ in range(6):
        frame = random_frame(display)
        frame.coded = lambda *_device: iter([[b"\xe0\x00"]])
        with pytest.raises(vd.DeviceError, match=r"OP \(7\) at byte 3: op E0") as caught:
            display.present(frame)
        assert caught.value.code == spec.CODE_OP
    frame = random_frame(display)
    display.present(frame)
    assert_shows(pipe, frame)
    assert pipe.device.refused == {spec.CODE_OP: 6}


def test_a_code_that_nobody_knows(opened):
    display, pipe = opened()
    error = packets.encode(packets.Error(code=99, session=0, offset=0))
    pipe.answers = lambda data: error + data
    with pytest.raises(vd.DeviceError, match=r"an unknown code \(99\) at byte 0$"):
        display.clear()


# -- another device, or none


def info_with(**fields):
    return lambda packet: (
        dataclasses.replace(packet, **fields) if isinstance(packet, packets.Info) else packet
    )


@pytest.mark.parametrize(
    ("fields", "what"), [({"major": 2}, "protocol 2"), ({"format": 9}, "pixel format 9")]
)
def test_a_device_that_cannot_be_served(opened, fields, what):
    pipe = Pipe()
    pipe.answers = changed(info_with(**fields))
    with pytest.raises(vd.IncompatibleDevice, match=what):
        opened(pipe)
    assert pipe.closed == 1


@pytest.mark.parametrize("noise", [b"", b"login: "])
def test_nothing_answers(opened, noise):
    pipe = Pipe()
    pipe.answers = lambda _data: noise
    with pytest.raises(vd.TransportTimeout, match="pipe:: nothing answered HELLO within 2 s"):
        opened(pipe)
    assert pipe.closed == 1
    assert pipe.now <= 2.01


def test_a_device_that_falls_silent(opened):
    display, pipe = opened()
    display.clear()
    pipe.answers = lambda _data: b""
    began_s = pipe.now
    with pytest.raises(vd.TransportTimeout, match="silent"):
        display.clear()
    assert pipe.now - began_s <= 2.1


def test_a_device_that_restarts_gets_its_picture_again(opened):
    display, pipe = opened()
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
def test_a_device_that_comes_back_as_another(opened, config, what):
    display, pipe = opened()
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
def test_an_interrupt_in_mid_present_leaves_it_usable(opened, where, moment):
    display, pipe = opened()
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
def test_a_frame_whose_coding_is_interrupted_is_never_shown(opened, wait):
    display, pipe = opened()
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
    broken.coded = coded
    with pytest.raises(KeyboardInterrupt):
        show(broken)
    assert display.present(last).frame == 2
    assert shown == [first.digest(), last.digest()]
    assert_shows(pipe, last)


def test_an_interrupted_read_does_not_disturb_the_next(opened):
    display, _ = opened()
    frame = random_frame(display, 1, 0.9)
    display.present(frame)

    def interrupt(*_place):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        display.read(progress=interrupt)
    display._connection.link.read(3, 4)  # as if it had been asked and not been fetched
    assert (display.read() == frame.array()).all()


def test_a_device_that_breaks_the_protocol(opened):
    display, pipe = opened()
    pipe.answers = lambda _data: document.on_wire(bytes.fromhex("80 00 00 01"))
    with pytest.raises(vd.RemoteProtocolError, match=r"protocol.md, section 9"):
        display.clear()
    pipe.answers = lambda data: data
    display.clear()


def test_a_display_says_what_it_shows(opened):
    display, pipe = opened()
    assert display.digest() == 0
    frame = display.frame()
    frame.draw([(1, 2, 3)])
    display.present(frame)
    pipe.now += 1000  # a long time in which nothing was asked
    assert display.digest() == frame.digest() == pipe.bench.snapshot().digest
    assert display.counters.statuses >= 2
    pipe.bench.power_cycle()
    assert display.digest() == 0


def test_a_display_without_digest_says_nothing_of_what_it_shows(opened):
    display, _ = opened(features=frozenset({"read"}))
    assert display.digest() is None
