"""The hands of a check: talk with a device, draw, look, and read back.

What is expected comes from ``decoder`` and ``page``.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import NoReturn

from voxdisplay.conformance import device_bugs, packets
from voxdisplay.conformance.announced import Said
from voxdisplay.conformance.dialogue import Broken, Dialogue, NotApplicable
from voxdisplay.conformance.packets import CLEAR, COMMIT, SHOWN, Answer
from voxdisplay.conformance.reference_decoder import Decoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

_MANY_PAGES = 10_000
# A PAGE is made of these alone (section 10).
_PAGE_OPS = (spec.OP_END, spec.OP_PEN)
_PAGE_COUNTS = (spec.OP_SKIP, spec.OP_RUN, spec.OP_LIT)


class Probe(Dialogue):
    """A device under examination: a `Dialogue` about pictures.

    Attributes
    ----------
    front : Page or None
        What must be on display; None if that is not known.
    """

    front: Page | None = None

    def begin(self, name: str) -> None:
        """See `Dialogue.begin`."""
        super().begin(name)
        self.front = None

    # -- pictures

    def draw(self, payload: bytes, *, clear: bool = True, commit: bool = False) -> list[Answer]:
        """Send one packet of the frame at hand, and see that it is taken."""
        flags = (CLEAR if clear else 0) | (COMMIT if commit else 0)
        seq = self.seq % 256
        come = self.say(packets.data(self.seq, self.frame, payload, flags))
        for answer in come:
            if answer.kind == spec.TYPE_ERROR:
                raise Broken("the packet is taken", str(answer), self._why_refused(answer, payload))
        self.seq += 1
        if self.state.kind != spec.TYPE_ACK or self.state.next == seq:
            raise Broken(f"the packet with sequence number {seq} is received", str(self.state))
        return come

    def _why_refused(self, error: Answer, payload: bytes) -> str:
        at = error.offset - packets.HEADER_BYTES
        found = device_bugs.refusals_by_mistake(self.said, payload)
        likely = _either(why for why, code, where in found if (code, where) == (error.code, at))
        if not likely and 0 <= at < len(payload):
            return f"look at how the op {payload[at]:02X} at byte {at} of the payload is read"
        return likely

    def show(self, *payloads: bytes, clear: bool = True, exactly: bool = False) -> Answer:
        """Draw a frame, wait until it is on display, and see that it is what the ops say.

        Parameters
        ----------
        *payloads : bytes
            The ops of each packet.
        clear : bool
            Whether the frame starts dark.
        exactly : bool
            Demand the right digest; otherwise it is enough if READ gives the right picture.

        Returns
        -------
        Answer
            The ACK that says that it is on display.
        """
        before = self.front or Page()
        after = Page() if clear else before.copy()
        decoder = Decoder(self.said, after)
        for payload in payloads:
            decoder.draw(payload)
        self.front = None
        come: list[Answer] = []
        for number, payload in enumerate(payloads):
            come += self.draw(payload, clear=clear, commit=number == len(payloads) - 1)
        ack = self.await_shown(self.frame, [*come, self.state])
        self.look(ack, after, before, list(payloads), clear=clear, exactly=exactly)
        self.front = after
        self.frame = (self.frame + 1) % 256
        return ack

    def await_shown(self, frame: int, come: list[Answer] | None = None) -> Answer:
        """Wait for an ACK that says that a frame is on display; ask for it if none comes."""
        for answer in come or []:
            if answer.kind == spec.TYPE_ACK and _shows(answer, frame):
                return answer
        until_s = self.clock() + self.patience_s
        while self.clock() < until_s:
            hear_until_s = self.clock() + max(1.2 * self.said.period_s, 0.02)
            while heard := self.hear(hear_until_s):
                if heard.kind == spec.TYPE_ACK and _shows(heard, frame):
                    return heard
            self.sync()
            if self.state.kind == spec.TYPE_ACK and _shows(self.state, frame):
                return self.state
        raise Broken(
            f"frame {frame} is on display",
            str(self.state),
            "is a whole frame shown at the next tick, and is SHOWN set then?",
        )

    def look(
        self,
        ack: Answer,
        must: Page,
        before: Page | None = None,
        payloads: list[bytes] | None = None,
        *,
        clear: bool = True,
        exactly: bool = False,
    ) -> None:
        """Demand that a page is on display; an ACK of now carries its digest."""
        said, before = self.said, before or Page()
        if said.has("DIGEST") and ack.digest == must.digest(said):
            return
        pixels = self.read_page() if said.has("READ") else None
        if pixels == must.pixels and not (exactly and said.has("DIGEST")):
            return
        if pixels is None and not said.has("DIGEST"):
            return
        base = Page() if clear else before
        self._disprove(ack, must, before, base, payloads or [], pixels)

    def _disprove(
        self,
        ack: Answer,
        must: Page,
        before: Page,
        base: Page,
        payloads: list[bytes],
        pixels: dict[int, int] | None,
    ) -> NoReturn:
        said = self.said
        right = must.digest(said)
        if pixels == must.pixels:
            likely = next(
                (
                    why
                    for d, why in device_bugs.digests_by_mistake(said, must, before)
                    if d == ack.digest
                ),
                "the pixels read back are right: the digest is not kept as section 8 says",
            )
            raise Broken(f"digest {right:08X}h", f"{ack.digest:08X}h", likely)

        def is_shown(page: Page) -> bool:
            if pixels is None:
                return page.digest(said) == ack.digest
            return page.pixels == pixels

        suspects = self._suspects(must, before, base, payloads)
        likely = _either(why for why, page in suspects if is_shown(page))
        if pixels is None:
            raise Broken(f"digest {right:08X}h", f"{ack.digest:08X}h", likely)
        differ = sorted(
            i for i in {*pixels, *must.pixels} if pixels.get(i, 0) != must.pixels.get(i, 0)
        )
        first = differ[0]
        raise Broken(
            f"pixel {must.pixels.get(first, 0):X}h at {said.place(first)}",
            f"{pixels.get(first, 0):X}h; {len(differ)} of {said.voxels} voxels are not as drawn",
            likely,
        )

    def _suspects(
        self, must: Page, before: Page, base: Page, payloads: list[bytes]
    ) -> Iterator[tuple[str, Page]]:
        yield from device_bugs.pages_by_mistake(self.said, base, payloads)
        yield from device_bugs.other_orders(self.said, must)
        for start, why in (
            (before, "CLEAR does not make the back page dark"),
            (Page(), "without CLEAR a frame starts as a copy of the front page: here it was dark"),
        ):
            page = start.copy()
            decoder = Decoder(self.said, page)
            for payload in payloads:
                decoder.draw(payload)
            yield why, page
        yield "the picture before is still on display", before
        yield "the display is dark", Page()

    # -- reading back

    def read_range(self, start: int, count: int, flags: int = 0) -> tuple[dict[int, int], int]:
        """READ once; give the pixels that are not dark, and how many voxels were covered."""
        page = self.ask_page(packets.read(start, count, 77, flags))
        return self.unpack(page, start, count), page.count

    def unpack(self, page: Answer, start: int, count: int) -> dict[int, int]:
        """Give the pixels of a PAGE that are not dark; demand that it answers such a READ."""
        decoder = PageReader(self.said, start)
        try:
            decoder.draw(page.tail)
        except Refused as refused:
            name = packets.CODE_NAMES[refused.code]
            raise Broken(
                "a PAGE of END, PEN, SKIP, RUN and LIT that stays in its range",
                f"{page.tail.hex(' ').upper()}: {name} at byte {refused.at} of the ops",
            ) from refused
        if not 1 <= page.count <= count or decoder.cursor != start + page.count:
            raise Broken(
                f"ops that cover `count` voxels, 1 to {count}",
                f"count {page.count}, and ops for {decoder.cursor - start}",
                "is `count` that of the ops, not that of the READ?",
            )
        return decoder.page.pixels

    def ask_page(self, packet: bytes) -> Answer:
        """Send a READ that must be answered with PAGE."""
        answer = self.ask(packet)
        self.demand(answer.kind == spec.TYPE_PAGE, "PAGE", answer)
        return answer

    def read_page(self, flags: int = 0) -> dict[int, int]:
        """Read a whole page."""
        pixels: dict[int, int] = {}
        at = 0
        for _ in range(_MANY_PAGES):
            if at >= self.said.voxels:
                return pixels
            part, count = self.read_range(at, self.said.voxels - at, flags)
            pixels |= part
            at += count
        raise NotApplicable(f"the device covers so little with a PAGE that only {at} could be read")


class PageReader(Decoder):
    """Draws the ops of a PAGE: the cursor begins at its start, and few ops are allowed."""

    def __init__(self, said: Said, start: int) -> None:
        super().__init__(said, Page())
        self._start = start

    def begin_packet(self) -> None:
        """See `Decoder.begin_packet`."""
        self.cursor, self.pen = self._start, self.said.full

    def _op(self, op: int) -> None:
        if op not in _PAGE_OPS and op & 0xE0 not in _PAGE_COUNTS:
            raise self.refuse(spec.CODE_OP)
        super()._op(op)


def _either(reasons: Iterable[str]) -> str:
    """Join the first few of several explanations."""
    return ", or: ".join(itertools.islice(dict.fromkeys(reasons), 3))


def _shows(ack: Answer, frame: int) -> bool:
    return bool(ack.flags & SHOWN) and ack.frame == frame
