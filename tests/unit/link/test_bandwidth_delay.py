"""Delivery rate, limit on bytes in flight, and payload length."""

import pytest
from link_rig import Rig, random_frame

from voxdisplay.link.bandwidth_delay import MAX_PACKETS, MIN_BYTES, MIN_PACKETS, DeliveryRate
from voxdisplay.link.payload_size import INITIAL_PAYLOAD, MIN_PAYLOAD, OVERHEAD_BYTES, LossRate


def deliver(rate, count, size, *, at_once, trip_s):
    """``count`` packets, ``at_once`` of them on their way at a time, each for ``trip_s``."""
    for _ in range(count):
        rate.sample(size, rate.delivered - (at_once - 1) * size, trip_s)


def test_before_anything_is_known_little_is_on_its_way():
    rate = DeliveryRate()
    assert rate.allows(MIN_PACKETS, 10**6)
    assert rate.allows(4, MIN_BYTES)
    assert not rate.allows(4, MIN_BYTES + 1)


def test_a_slow_line_is_not_sent_more_than_it_carries_soon():
    rate = DeliveryRate()
    deliver(rate, 10, 1000, at_once=2, trip_s=0.2)  # 10 kB/s
    assert not rate.allows(10, 10_000)
    assert rate.allows(MIN_PACKETS, 4000)


def test_a_fast_line_with_a_long_round_trip_is_kept_busy():
    rate = DeliveryRate()
    deliver(rate, 10, 1000, at_once=20, trip_s=0.02)  # 1 MB/s
    assert rate.allows(24, 24_000)
    assert not rate.allows(32, 64_000)


def test_a_short_round_trip_leaves_room_in_the_window():
    rate = DeliveryRate()
    deliver(rate, 10, 200, at_once=5, trip_s=0.001)  # 1 MB/s, and 1 kB is on its way
    assert rate.allows(MAX_PACKETS, MAX_PACKETS * 200)
    assert not rate.allows(MAX_PACKETS + 1, (MAX_PACKETS + 1) * 200)


def test_a_standing_queue_is_not_taken_for_a_long_line():
    rate = DeliveryRate()
    deliver(rate, 1, 1000, at_once=1, trip_s=0.004)
    deliver(rate, 1000, 1000, at_once=30, trip_s=0.12)  # 250 kB/s all the while
    assert not rate.allows(31, 31_000)


def test_a_rate_that_is_gone_is_forgotten():
    rate = DeliveryRate()
    deliver(rate, 10, 1000, at_once=10, trip_s=0.001)
    assert rate.allows(MAX_PACKETS, 200_000)
    deliver(rate, 1000, 1000, at_once=2, trip_s=0.1)
    assert not rate.allows(MAX_PACKETS, 10_000)


def test_payloads_begin_at_1_kib_and_grow_while_nothing_is_lost():
    losses = LossRate()
    assert losses.best_payload == INITIAL_PAYLOAD
    for _ in range(10_000):
        losses.count_sent(1000)
    assert losses.best_payload > 16 * INITIAL_PAYLOAD


@pytest.mark.parametrize("every_bytes", [30_000, 100_000, 1_000_000])
def test_payloads_suit_the_losses(every_bytes):
    losses = LossRate()
    for count in range(1, 200):
        losses.count_sent(every_bytes)
        losses.count_damage(count)
    best = (OVERHEAD_BYTES * every_bytes) ** 0.5
    assert 0.7 * best < losses.best_payload < 1.4 * best


def test_payloads_do_not_shrink_to_nothing():
    losses = LossRate()
    for count in range(1000):
        losses.count_sent(100)
        losses.count_damage(3 * count)
    assert losses.best_payload == MIN_PAYLOAD


def test_damage_of_others_counts_once_and_the_count_wraps_around():
    losses = LossRate()
    assert losses.count_damage(500) == 1
    assert losses.count_damage(500) == 0
    assert losses.count_damage(65_535) == 65_035
    assert losses.count_damage(2) == 3
    assert LossRate().count_damage(0) == 0


def test_the_rate_is_known_once_the_line_was_busy():
    rate = DeliveryRate()
    deliver(rate, 3, 200, at_once=1, trip_s=0.02)
    assert rate.bytes_per_s is None
    deliver(rate, 10, 1000, at_once=5, trip_s=0.5)
    assert rate.bytes_per_s == pytest.approx(10_000, rel=0.2)


def test_a_device_that_starts_again_counts_damage_from_0():
    rig = Rig(max_payload=300, rx_buffer=4096)
    rig.present(random_frame(rig.rng))
    rig.run()
    rig.device.receive(b"\0" + b"\x0b0123456789\0" * 3)  # three damaged segments
    rig.present(random_frame(rig.rng))
    rig.run()
    before = rig.link.payload_bytes
    rig.power_cycle()
    rig.present(random_frame(rig.rng))
    rig.run()
    assert rig.restarts == 1
    assert rig.link.payload_bytes >= before > MIN_PAYLOAD
    assert rig.link.counters.device_damaged < 10
