"""Link and emulated device over a lossy line: whole frames only, and in the end the last."""

import random
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from link_rig import Faults, Rig, frames, random_frame

from firmware_sim.session import DataAction, Session
from voxdisplay.errors import TransportTimeout
from voxdisplay.link import PacketRefused, PageReceived
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.spans import decode_spans


@pytest.fixture(autouse=True, scope="module")
def _no_device_is_sent_what_it_has():
    """9.3: "no packet is on its way twice", whatever the line does."""
    judge = Session.classify

    def watched(session, *packet):
        verdict = judge(session, *packet)
        assert verdict is not DataAction.DUPLICATE
        return verdict

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Session, "classify", watched)
        yield


seeds = st.integers(0, 2**32 - 1)
devices = st.fixed_dictionaries(
    {
        "refresh": st.sampled_from([0, 0, 30_000, 1_000_000, 2_000, 150]),
        "max_payload": st.sampled_from([64, 65, 100, 247, 300]),
        "max_silent_acks": st.sampled_from([0, 8]),
        "room": st.sampled_from([0, 1, 64, 1000, 20_000]),
        "pixel_format": st.sampled_from([format_.value for format_ in PixelFormat]),
        "delay_s": st.sampled_from([0.0, 0.0001, 0.01, 0.3, 1.0]),
        "jitter_s": st.sampled_from([0.0, 0.02]),
    }
)


def rig_of(seed, device):
    """A device whose receive buffer has so much room above the least that is allowed."""
    longest = device["max_payload"] + spec.LIMIT_OVERHEAD
    least = longest + -(-longest // 254) + 1 + spec.LIMIT_RESERVE
    config = {key: value for key, value in device.items() if key != "room"}
    # Where two answers of three are lost, 20 s of silence do happen.
    return Rig(seed=seed, rx_buffer=least + device["room"], timeout_s=60, **config)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seeds, devices)
def test_without_faults_every_frame_is_shown_and_nothing_is_sent_twice(seed, device):
    """9.3: "Then, and only then, the host sends it again"; and nothing is polled."""
    rig = rig_of(seed, device)
    drawn = frames(rig.rng, rig.rng.randrange(1, 5), device["pixel_format"])
    tickets = [rig.present(frame) for frame in drawn]
    rig.run()
    rig.assert_shows(drawn[-1])
    rig.assert_reported(tickets[-1])
    assert rig.link.counters.retransmitted == 0
    assert rig.link.counters.sessions == 1
    sent = Counter(body[0] >> 4 for body in rig.sent)
    if not device["jitter_s"]:  # otherwise it may be silent for longer than usual
        # After several HELLO a small buffer may have no credit yet that the host knows of.
        assert sent[spec.TYPE_STATUS] <= (sent[spec.TYPE_HELLO] > 1)
    most = device["max_payload"]
    assert sent[spec.TYPE_DATA] == sum(max(1, len(frame.payloads(most))) for frame in drawn)


def faults_of(rng):
    kind = rng.choice(["flip", "drop", "packet", "delimiter", "all"])
    rates = {"flip": 0.002, "drop": 0.002, "packet": 0.15, "delimiter": 0.15}
    return Faults(rng.getrandbits(32), **(rates if kind == "all" else {kind: rates[kind]}))


@settings(max_examples=120, deadline=None, derandomize=True)
@given(seeds, devices, st.sampled_from(["down", "up", "both"]))
def test_after_the_last_fault_the_last_frame_is_shown(seed, device, where):
    """5: "A frame that is not whole MUST NOT be shown" is checked after every step."""
    rig = rig_of(seed, device)
    if where != "up":
        rig.down.faults = faults_of(rig.rng)
    if where != "down":
        rig.up.faults = faults_of(rig.rng)
    drawn = frames(rig.rng, 4, device["pixel_format"])
    for frame in drawn[:2]:
        rig.present(frame)
    for _ in range(rig.rng.randrange(80)):
        rig.step()
    rig.down.faults = rig.up.faults = None
    tickets = [rig.present(frame) for frame in drawn[2:]]
    rig.run()
    rig.assert_shows(drawn[-1])
    rig.assert_reported(tickets[-1])


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    seeds,
    st.sampled_from([0.0, 0.01, 0.3]),
    st.sampled_from([1e-6, 1e-5, 1e-4]),
    st.sampled_from(["down", "up", "both"]),
)
def test_long_and_short_frames_on_a_slow_bad_line(seed, delay_s, byte_s, where):
    """Windows that are full of one frame, and packets that are dropped because of the one before.

    On a slow line ACKs come one by one: those from before something was sent again, behind it.
    """
    rig = Rig(
        seed=seed,
        delay_s=delay_s,
        byte_s=byte_s,
        rx_buffer=5000,
        max_silent_acks=seed % 9,
        timeout_s=60,
    )
    if where != "up":
        rig.down.faults = Faults(seed, packet=0.05, flip=0.003)
    if where != "down":
        rig.up.faults = Faults(seed + 1, packet=0.15)
    tickets = [rig.link.present([bytes(40)] * length) for length in (60, 1, 2, 1, 5, 1) * 4]
    rig.run(steps=20_000)
    assert rig.shown[-1] == tickets[-1]


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seeds, devices, st.integers(0, 60), st.integers(1, 3))
def test_a_device_that_loses_its_power(seed, device, when, times):
    rig = rig_of(seed, device)
    drawn = frames(rig.rng, 3, device["pixel_format"])
    tickets = [rig.present(frame) for frame in drawn]
    for _ in range(times):
        for _ in range(when):
            rig.step()
        rig.power_cycle()
    tickets.append(rig.present(drawn[0]))
    rig.run()
    rig.assert_shows(drawn[0])
    rig.assert_reported(tickets[-1])
    assert rig.restarts <= times


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seeds, devices, st.floats(0.01, 8), st.integers(1, 50))
def test_a_line_that_stalls(seed, device, stall_s, when):
    rig = rig_of(seed, device)
    drawn = frames(rig.rng, 3, device["pixel_format"])
    for frame in drawn:
        rig.present(frame)
    for _ in range(when):
        rig.step()
    rig.rng.choice([rig.down, rig.up]).stalled_until_s = rig.now + stall_s
    last = rig.present(drawn[0])
    rig.run()
    rig.assert_shows(drawn[0])
    rig.assert_reported(last)
    if stall_s < 0.7:  # fewer than four questions long: it is sat out
        assert rig.link.counters.sessions == 1


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seeds, devices, st.booleans())
def test_a_page_is_read_through_a_bad_line(seed, device, bad):
    rig = rig_of(seed, device)
    frame = random_frame(rig.rng, device["pixel_format"], 0.9)
    rig.present(frame)
    rig.run()
    if bad:
        rig.down.faults, rig.up.faults = (Faults(seed + k, packet=0.1) for k in (0, 1))
    total, at, values = frame.grid.voxels, 0, []
    while at < total:
        rig.events.clear()
        rig.link.read(at, total - at)
        rig.run(lambda: any(isinstance(event, PageReceived) for event in rig.events))
        (page,) = (event.page for event in rig.events if isinstance(event, PageReceived))
        values += decode_spans(page.ops, page.count, frame.format).tolist()
        at += page.count
    assert values == frame.format.values(frame.array()).tolist()


def test_numbers_wrap_around():
    """Sequence numbers and frame ids are modulo 256, also with losses on the way."""
    rig = Rig(refresh=0, rx_buffer=2000)
    rig.down.faults = Faults(1, packet=0.02)
    drawn = frames(random.Random(5), 6)
    for number in range(700):
        last = rig.present(drawn[number % 6])
        if number % 8 == 0:
            rig.run()
    rig.down.faults = None
    rig.run()
    rig.assert_shows(drawn[699 % 6])
    rig.assert_reported(last)
    assert rig.link.counters.packets > 5 * 256
    assert rig.link.counters.sessions == 1
    assert len({body[2] for body in rig.sent if body[0] >> 4 == spec.TYPE_DATA}) == 256


def test_a_frame_on_top_of_what_is_shown():
    """6: without CLEAR a frame starts as a copy of the front page."""
    rig = Rig()
    frame = random_frame(rig.rng)
    rig.present(frame)
    rig.run()
    rig.link.present([], clear=False)
    rig.run()
    rig.assert_shows(frame)
    assert len(rig.shown) == 2


def changed_a_little(rng, frame):
    """A frame that differs in some voxels; some of them become dark."""
    other = frame.copy()
    for color in ("black", "white"):
        other.draw([[rng.randrange(side) for side in frame.grid] for _ in range(20)], color)
    return other


@settings(max_examples=80, deadline=None, derandomize=True)
@given(seeds, devices, st.sampled_from(["", "down", "up", "both", "power"]), st.integers(0, 30))
def test_differences_on_a_bad_line(seed, device, what, when):
    """Whatever happens, no page is seen that nobody meant, and in the end it is the last."""
    rig = rig_of(seed, device)
    frame = random_frame(rig.rng, device["pixel_format"], rig.rng.choice([0.02, 0.9]))
    rig.present(frame)
    rig.run()
    for _ in range(3):
        base, frame = frame, changed_a_little(rig.rng, frame)
        if what in {"down", "both"}:
            rig.down.faults = faults_of(rig.rng)
        if what in {"up", "both"}:
            rig.up.faults = faults_of(rig.rng)
        ticket = rig.present_difference(base, frame)
        for _ in range(when):
            rig.step()
        if what == "power":
            was_shown = ticket in rig.shown
            rig.power_cycle()
            if was_shown:
                ticket = rig.present_difference(frame, frame)
        rig.down.faults = rig.up.faults = None
        rig.run()
        rig.assert_shows(frame)
        rig.assert_reported(ticket)
    if not what:
        data = [body for body in rig.sent if body[0] >> 4 == spec.TYPE_DATA]
        flags = [body[0] & spec.DATA_FLAG_CLEAR for body in data]
        assert flags == sorted(flags, reverse=True)
        assert not flags[-1]


@pytest.mark.parametrize("features", [frozenset(), frozenset({"read"})])
def test_a_device_without_digest_gives_none(features):
    rig = Rig(features=features)
    rig.present(random_frame(rig.rng))
    rig.run()
    assert rig.events[-1].digest is None


@pytest.mark.parametrize("refresh", [0, 30_000, 150])
@pytest.mark.parametrize("moment", [0, 1, 3, 8])
def test_a_device_that_dies_is_given_up_within_the_timeout(refresh, moment):
    rig = Rig(refresh=refresh, timeout_s=3)
    for _ in range(4):
        rig.present(random_frame(rig.rng))
    for _ in range(moment):
        rig.step()
    rig.alive = False
    died_s = rig.now
    with pytest.raises(TransportTimeout, match=r"silent|nothing answered HELLO"):
        rig.run()
    assert rig.now - died_s <= 3 + (1000 / refresh if refresh else 0) + 0.01


def test_a_device_that_dies_under_a_short_timeout():
    rig = Rig(timeout_s=0.3)
    rig.present(random_frame(rig.rng))
    rig.run(lambda: rig.link.ready)
    rig.alive = False
    with pytest.raises(TransportTimeout, match=r"silent for 0.3 s"):
        rig.run()


def test_a_device_that_talks_but_never_shows_anything():
    rig = Rig(refresh=30_000, timeout_s=3)  # and yet its ticks never come
    rig._tick = lambda: None
    rig._tick_after = lambda _now: float("inf")
    rig.present(random_frame(rig.rng, density=0.02))
    with pytest.raises(TransportTimeout, match="nothing was delivered"):
        rig.run()
    assert rig.now < 8


def test_a_device_that_is_slower_than_the_timeout_is_waited_for():
    """A device that waits for its tick cannot answer: 6, point 6."""
    rig = Rig(refresh=50, timeout_s=2)  # a tick in 20 s
    drawn = [random_frame(rig.rng) for _ in range(3)]
    for frame in drawn:
        rig.present(frame)
    rig.run()
    rig.assert_shows(drawn[-1])
    assert rig.link.counters.sessions == 1


def test_a_refused_frame_is_an_event_and_the_next_is_shown():
    rig = Rig()
    rig.refusals.add("OP")
    rig.link.present([b"\x07"])
    rig.run(lambda: any(isinstance(event, PacketRefused) for event in rig.events))
    for _ in range(2):
        frame = random_frame(rig.rng)
        ticket = rig.present(frame)
        rig.run()
        rig.assert_shows(frame)
        rig.assert_reported(ticket)
    assert rig.restarts == 0


@pytest.mark.slow
@settings(max_examples=3000, deadline=None, derandomize=True)
@given(seeds, devices, st.sampled_from(["down", "up", "both"]))
def test_after_many_more_faults(seed, device, where):
    test_after_the_last_fault_the_last_frame_is_shown.hypothesis.inner_test(seed, device, where)
