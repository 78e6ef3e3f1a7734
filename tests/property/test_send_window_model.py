"""Model-based test of `SendWindow`: what it infers against the true state of line and device.

The device is as free as protocol.md, section 9, allows: which ACKs it omits, how its credit
shrinks, when its tick comes. The model numbers packets without modulus.
"""

import random
from collections import Counter, deque
from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st

from voxdisplay.link.send_window import SendWindow
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

LONGEST = 90
STATUS_BYTES = 9
seeds = st.integers(0, 2**32 - 1)


@dataclass(frozen=True)
class Sent:
    """One transmission: a packet of a frame, or the STATUS of a tag."""

    ordinal: int
    end: int  # of its bytes, in all that was sent
    packet: int = -1
    frame: int = -1
    ends_frame: bool = False
    tag: int = -1


class Device:
    """Sections 6 and 9: what it has received, what it shows, and what it has promised."""

    def __init__(self, rng, buffer, credit_kind):
        self.rng, self.buffer, self.credit_kind = rng, buffer, credit_kind
        self.received = set()
        self.missing = 0  # the lowest number that is
        self.taken = 0  # the newest ordinal
        self.read_end = 0  # where in the stream it has got
        self.promised = buffer
        self.failed = Counter()  # transmissions of a packet that it did not receive
        self.answers = deque()
        self._last = Sent(0, 0, packet=255)  # of DATA
        self._frame, self._commit, self._open = -1, -1, False
        self._left_out = 0

    @property
    def pending(self):
        return self._open and 0 <= self._commit < self.missing

    def must_wait(self, sent):
        return sent.packet >= 0 and self.pending and sent.frame != self._frame

    def take(self, sent, fate, *, more):
        """Read a transmission; ``more`` if others that can be taken at once are behind it."""
        self.read_end = sent.end
        if fate != "arrives":
            self.failed[sent.packet] += 1
            if fate == "damaged":
                self.acknowledge()
            return
        self.taken = sent.ordinal
        if sent.tag >= 0:
            self.acknowledge(sent)
            return
        self._take_data(sent)
        self._last = sent
        self._left_out += 1
        if not more or self._left_out > spec.LIMIT_MAX_SILENT or self.rng.random() < 0.3:
            self.acknowledge()

    def _take_data(self, sent):
        assert sent.packet not in self.received, "sent again although it had arrived"
        assert sent.packet < self.missing + spec.LIMIT_WINDOW
        if sent.frame != self._frame:
            if self._open and sent.packet != self.missing:
                self.failed[sent.packet] += 1  # point 6: dropped
                return
            self._frame, self._commit, self._open = sent.frame, -1, True
        if sent.ends_frame:
            self._commit = sent.packet
        self.received.add(sent.packet)
        while self.missing in self.received:
            self.missing += 1

    def tick(self):
        if self.pending:
            self._open = False
            self.acknowledge()

    def flush(self):
        if self._left_out:
            self.acknowledge()

    def acknowledge(self, status=None):
        self._left_out = 0
        named = status or self._last
        least = named.end + spec.LIMIT_RESERVE + LONGEST
        place = {
            "ring": named.end + self.buffer,  # as large as the ring, always
            "all": self.read_end + self.buffer,  # also what damaged segments have left free
            "little": self.rng.randint(least, max(least, self.read_end + self.buffer)),
        }[self.credit_kind]
        self.promised = max(self.promised, min(place, self.read_end + self.buffer))
        flags = 0 if status is None else spec.ACK_FLAG_ASKED
        ahead = (n - self.missing - 1 for n in self.received if n > self.missing)
        self.answers.append(
            packets.Ack(
                seq=self.missing % 256,
                flags=flags,
                last=(named.packet if status is None else named.tag) % 256,
                session=1,
                boot=1,
                received=sum(1 << bit for bit in ahead),
                credit=self.promised - named.end,
                digest=0,
                damaged=0,
            )
        )


class Model:
    """Host, line and device, which act in rounds of random length."""

    def __init__(self, seed):
        self.rng = rng = random.Random(seed)
        room = rng.choice([0, 1, LONGEST, 1000, 10_000])
        buffer = spec.LIMIT_RESERVE + LONGEST + room
        self.device = Device(rng, buffer, rng.choice(["ring", "all", "little"]))
        self.window = SendWindow(buffer)
        self.faults = rng.choice([0, 0.02, 0.1, 0.3])
        self.line = deque()  # of (transmission, what becomes of it)
        self.sent = []  # all transmissions
        self.times = Counter()  # that a packet was sent
        self.statuses = 0
        self._tag = 0
        self._frame_of = []  # of each packet: its frame, and whether it ends it
        self._packets = {}  # sequence number -> the packet that has it now
        self._frames = 0

    # -- the host

    def _new_frame(self):
        length = self.rng.choice([1, 1, 2, 3, 10, 40])
        self._frame_of += [(self._frames, k + 1 == length) for k in range(length)]
        self._frames += 1

    def send_new(self):
        """Send a new packet, if window and credit allow it."""
        if not (self.window.has_room and self.window.has_credit(LONGEST)):
            return False
        number = len(self.times)
        if number == len(self._frame_of):
            self._new_frame()
        seq = self.window.add(bytes(self.rng.randint(12, LONGEST)))
        assert seq == number % 256
        self._packets[seq] = number
        self._send(seq)
        return True

    def retransmit(self):
        """Send a lost packet again, if there is credit for it."""
        seq = self.window.first_lost()
        if seq is None or not self.window.has_credit(len(self.window.outstanding[seq].wire)):
            return False
        self._send(seq)
        return True

    def _send(self, seq):
        number = self._packets[seq]
        size = len(self.window.send(seq, 0.0))
        self.times[number] += 1
        frame, ends_frame = self._frame_of[number]
        self._put(size, packet=number, frame=frame, ends_frame=ends_frame)

    def poll(self):
        self.statuses += 1
        self._tag = (self._tag + 1) % 256
        self.window.send_tagged(self._tag, STATUS_BYTES)
        self._put(STATUS_BYTES, tag=self._tag)

    def _put(self, size, **what):
        end = (self.sent[-1].end if self.sent else 0) + size
        assert end <= self.device.read_end + self.device.buffer, "the buffer overflows"
        self.sent.append(Sent(len(self.sent) + 1, end, **what))
        fate = self.rng.choice(["damaged", "gone"])
        self.line.append((self.sent[-1], fate if self.rng.random() < self.faults else "arrives"))

    # -- the device, and back

    def deliver(self, count):
        """Deliver the next transmissions to the device."""
        come = [self.line.popleft() for _ in range(min(count, len(self.line)))]
        while come:
            sent, fate = come[0]
            if fate == "arrives" and self.device.must_wait(sent):
                break
            del come[0]
            follows = bool(come) and come[0][1] == "arrives"
            self.device.take(sent, fate, more=follows and not self.device.must_wait(come[0][0]))
        self.device.flush()
        self.line.extendleft(reversed(come))

    def receive(self, count):
        for _ in range(min(count, len(self.device.answers))):
            answer = self.device.answers.popleft()
            if self.rng.random() >= self.faults:
                for flight in self.window.acknowledge(answer):
                    assert self.sent[flight.ordinal - 1].packet in self.device.received
                self.check()

    def check(self):
        """Check that all that the window infers is true."""
        window, device = self.window, self.device
        assert window.taken <= device.taken
        on_the_line = {sent.ordinal for sent, _ in self.line}
        for seq, flight in window.outstanding.items():
            if flight.lost:
                assert flight.ordinal not in on_the_line, "lost, and still on its way"
                assert self._packets[seq] not in device.received, "lost, and received"
        free = device.promised - self.sent[-1].end - spec.LIMIT_RESERVE
        assert not window.has_credit(free + 1), "more than was promised"

    # -- turns

    def act(self):
        """Do some of all that may happen."""
        for act in self.rng.choices(
            [self.send_new, self.retransmit], [2, 3], k=self.rng.randrange(12)
        ):
            act()
        if self.rng.random() < 0.2 and self._asked < spec.LIMIT_MAX_STATUS:
            self.poll()
        self.deliver(self.rng.randrange(12))
        if self.rng.random() < 0.6:
            self.device.tick()
        self.receive(self.rng.randrange(8))

    @property
    def _asked(self):
        """STATUS that may still be answered."""
        on_the_line = sum(sent.tag >= 0 for sent, _ in self.line)
        return on_the_line + sum(a.flags & spec.ACK_FLAG_ASKED > 0 for a in self.device.answers)

    def finish(self):
        """Deliver all over a line without faults, in few rounds; no new packet is sent."""
        self.faults = 0
        for _ in range(200):
            if not (self.window.outstanding or self.line):
                return
            before = len(self.sent)
            while self.retransmit():
                pass
            if len(self.sent) == before and not self.line:
                self.poll()
            self.deliver(100)
            self.device.tick()
            self.receive(100)
        raise AssertionError("it does not end")


def run(seed, rounds):
    model = Model(seed)
    for _ in range(rounds):
        model.act()
    model.finish()
    assert model.device.received == set(model.times)
    assert all(count == 1 + model.device.failed[n] for n, count in model.times.items())
    return model


@settings(max_examples=150, deadline=None, derandomize=True)
@given(seeds, st.sampled_from([3, 30, 300]))
def test_what_the_host_infers_is_true(seed, rounds):
    """9.3: "A host therefore never guesses"; and no packet is sent more often than it fails."""
    run(seed, rounds)
