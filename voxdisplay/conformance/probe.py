"""Operations of a check on a device: draw, present, verify what is on display, and read back.

The expected pixels come from ``reference_decoder`` and ``reference_page``.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import NoReturn

from voxdisplay.conformance import device_bugs, packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.dialogue import Dialogue, NotApplicable, Violation
from voxdisplay.conformance.packets import CLEAR, COMMIT, SHOWN, Response
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

_MAX_PAGE_PACKETS = 10_000
# A PAGE is made of these alone (section 10).
_PAGE_OPS = (spec.OP_END, spec.OP_PEN)
_PAGE_COUNTS = (spec.OP_SKIP, spec.OP_RUN, spec.OP_LIT)


class Probe(Dialogue):
    """A device under test whose pages are known: a `Dialogue` with drawing and readback.

    Attributes
    ----------
    front : Page or None
        The page that must be on display; None if it is not known.
    silent_failures : int
        Number of checks that were broken while a response was waited for in vain.
    """

    front: Page | None = None
    silent_failures = 0

    def start_check(self, name: str) -> None:
        """See `Dialogue.start_check`."""
        super().start_check(name)
        self.front = None

    # -- pictures

    def draw(self, payload: bytes, *, clear: bool = True, commit: bool = False) -> list[Response]:
        """Send one packet of the current frame; raise `Violation` unless it is received."""
        flags = (CLEAR if clear else 0) | (COMMIT if commit else 0)
        seq = self.seq % 256
        responses = self.send_and_poll(packets.data(self.seq, self.frame, payload, flags))
        for answer in responses:
            if answer.kind == spec.TYPE_ERROR:
                raise Violation(
                    "the packet is taken", str(answer), self._refusal_cause(answer, payload)
                )
        self.seq += 1
        if self.state.kind != spec.TYPE_ACK or self.state.next == seq:
            raise Violation(f"the packet with sequence number {seq} is received", str(self.state))
        return responses

    def _refusal_cause(self, error: Response, payload: bytes) -> str:
        at = error.offset - packets.HEADER_BYTES
        found = device_bugs.refusals_by_bug(self.device, payload)
        likely = _join_causes(
            why for why, code, where in found if (code, where) == (error.code, at)
        )
        if not likely and 0 <= at < len(payload):
            return f"check how the op {payload[at]:02X} at byte {at} of the payload is decoded"
        return likely

    def show(self, *payloads: bytes, clear: bool = True, exactly: bool = False) -> Response:
        """Draw and present a frame, and require that it is on display as the ops define it.

        Parameters
        ----------
        *payloads : bytes
            The ops of each packet.
        clear : bool
            True if the frame starts dark.
        exactly : bool
            Require the right digest; otherwise the right pixels, read back, suffice.

        Returns
        -------
        Answer
            The ACK that reports it as on display.
        """
        before = self.front or Page()
        after = Page() if clear else before.copy()
        decoder = ReferenceDecoder(self.device, after)
        for payload in payloads:
            decoder.draw(payload)
        self.front = None
        responses: list[Response] = []
        for number, payload in enumerate(payloads):
            responses += self.draw(payload, clear=clear, commit=number == len(payloads) - 1)
        ack = self.await_shown(self.frame, [*responses, self.state])
        self.require_displayed(ack, after, before, list(payloads), clear=clear, exactly=exactly)
        self.front = after
        self.frame = (self.frame + 1) % 256
        return ack

    def await_shown(self, frame: int, responses: list[Response] | None = None) -> Response:
        """Wait for an ACK that reports a frame as on display, polling with STATUS if none comes."""
        for answer in responses or []:
            if answer.kind == spec.TYPE_ACK and _is_shown(answer, frame):
                return answer
        until_s = self.clock() + self.response_timeout_s
        while self.clock() < until_s:
            receive_until_s = self.clock() + max(1.2 * self.device.period_s, 0.02)
            while response := self.receive(receive_until_s):
                if response.kind == spec.TYPE_ACK and _is_shown(response, frame):
                    return response
            self.poll_status()
            if self.state.kind == spec.TYPE_ACK and _is_shown(self.state, frame):
                return self.state
        self.timeout_count += 1
        raise Violation(
            f"frame {frame} is on display",
            str(self.state),
            "a whole frame is not presented at the next tick, or SHOWN is not set then",
        )

    def require_displayed(
        self,
        ack: Response,
        must: Page,
        before: Page | None = None,
        payloads: list[bytes] | None = None,
        *,
        clear: bool = True,
        exactly: bool = False,
    ) -> None:
        """Require that a page is on display, by the digest of a current ACK or by readback."""
        device, before = self.device, before or Page()
        if device.has("DIGEST") and ack.digest == must.digest(device):
            return
        pixels = self.read_page() if device.has("READ") else None
        if pixels == must.pixels and not (exactly and device.has("DIGEST")):
            return
        if pixels is None and not device.has("DIGEST"):
            return
        base = Page() if clear else before
        self._raise_mismatch(ack, must, before, base, payloads or [], pixels)

    def require_readback(self, must: Page) -> None:
        """Require that a page is on display by readback, where READ is announced.

        A digest alone does not show a page that was changed without it.
        """
        if self.device.has("READ"):
            pixels = self.read_page()
            if pixels != must.pixels:
                self._raise_mismatch(self.state, must, Page(), Page(), [], pixels)

    def _raise_mismatch(
        self,
        ack: Response,
        must: Page,
        before: Page,
        base: Page,
        payloads: list[bytes],
        pixels: dict[int, int] | None,
    ) -> NoReturn:
        device = self.device
        right = must.digest(device)
        if pixels == must.pixels:
            likely = next(
                (
                    why
                    for d, why in device_bugs.digests_by_bug(device, must, before)
                    if d == ack.digest
                ),
                "the pixels read back are right: the digest is not updated as section 8 says",
            )
            raise Violation(f"digest {right:08X}h", f"{ack.digest:08X}h", likely)

        def is_shown(page: Page) -> bool:
            if pixels is None:
                return page.digest(device) == ack.digest
            return page.pixels == pixels

        suspects = self._pages_by_cause(must, before, base, payloads)
        causes = (why for why, page in suspects if is_shown(page))
        pen = None if pixels is None else self._surviving_pen(must, pixels)
        why_pen = [device_bugs.PenNotReset.__doc__ or ""]
        likely = _join_causes(
            itertools.chain(why_pen if pen else (), causes, why_pen if pen == 0 else ())
        )
        if pixels is None:
            raise Violation(f"digest {right:08X}h", f"{ack.digest:08X}h", likely)
        differ = sorted(
            i for i in {*pixels, *must.pixels} if pixels.get(i, 0) != must.pixels.get(i, 0)
        )
        first = differ[0]
        raise Violation(
            f"pixel {must.pixels.get(first, 0):X}h at {device.voxel_at(first)}",
            f"{pixels.get(first, 0):X}h; {len(differ)} of {device.voxel_count} voxels differ",
            likely,
        )

    def _surviving_pen(self, must: Page, pixels: dict[int, int]) -> int | None:
        """Return the pixel that all full pixels, and no others, became; None if there is none."""
        full = {i for i, value in must.pixels.items() if value == self.device.full_pixel}
        others = {*must.pixels, *pixels} - full
        pens = {pixels.get(i, 0) for i in full}
        same_others = all(pixels.get(i) == must.pixels.get(i) for i in others)
        return pens.pop() if len(pens) == 1 and same_others else None

    def _pages_by_cause(
        self, must: Page, before: Page, base: Page, payloads: list[bytes]
    ) -> Iterator[tuple[str, Page]]:
        if payloads:
            yield from device_bugs.pages_by_bug(self.device, base, payloads)
        yield from device_bugs.pages_by_scan_order(self.device, must)
        for start, why in (
            (before, "CLEAR does not make the back page dark"),
            (Page(), "without CLEAR a frame starts as a copy of the front page: here it was dark"),
        ):
            if not payloads:
                break
            page = start.copy()
            decoder = ReferenceDecoder(self.device, page)
            for payload in payloads:
                decoder.draw(payload)
            yield why, page
        yield "the picture before is still on display", before
        yield "the display is dark", Page()

    # -- reading back

    def read_range(self, start: int, count: int, flags: int = 0) -> tuple[dict[int, int], int]:
        """Send one READ; return the lit pixels by index, and the number of voxels covered."""
        page = self.request_page(packets.read(start, count, 77, flags))
        return self.decode_page(page, start, count), page.count

    def decode_page(self, page: Response, start: int, count: int) -> dict[int, int]:
        """Return the lit pixels of a PAGE; require that it is valid for a READ of this range."""
        decoder = PageOpsDecoder(self.device, start)
        try:
            decoder.draw(page.tail)
        except Refused as refused:
            name = packets.CODE_NAMES[refused.code]
            raise Violation(
                "a PAGE of END, PEN, SKIP, RUN and LIT that stays in its range",
                f"{page.tail.hex(' ').upper()}: {name} at byte {refused.at} of the ops",
            ) from refused
        if not 1 <= page.count <= count or decoder.cursor != start + page.count:
            raise Violation(
                f"ops that cover `count` voxels, 1 to {count}",
                f"count {page.count}, and ops for {decoder.cursor - start}",
                "`count` must be that of the ops, not that of the READ",
            )
        return decoder.page.pixels

    def request_page(self, packet: bytes) -> Response:
        """Send a READ and require a PAGE in response."""
        answer = self.request(packet)
        self.require(answer.kind == spec.TYPE_PAGE, "PAGE", answer)
        return answer

    def read_page(self, flags: int = 0) -> dict[int, int]:
        """Read a whole page; return its lit pixels by index."""
        pixels: dict[int, int] = {}
        at = 0
        for _ in range(_MAX_PAGE_PACKETS):
            if at >= self.device.voxel_count:
                return pixels
            part, count = self.read_range(at, self.device.voxel_count - at, flags)
            pixels |= part
            at += count
        raise NotApplicable(f"PAGEs cover too few voxels: {_MAX_PAGE_PACKETS} hold only {at}")


class PageOpsDecoder(ReferenceDecoder):
    """Decoder of the ops of a PAGE: the cursor begins at its start, and few ops are allowed."""

    def __init__(self, device: AnnouncedDevice, start: int) -> None:
        super().__init__(device, Page())
        self._start = start

    def begin_packet(self) -> None:
        """See `ReferenceDecoder.begin_packet`."""
        self.cursor, self.pen = self._start, self.device.full_pixel

    def _op(self, op: int) -> None:
        if op not in _PAGE_OPS and op & 0xE0 not in _PAGE_COUNTS:
            raise self.refusal(spec.CODE_OP)
        super()._op(op)


def _join_causes(reasons: Iterable[str]) -> str:
    """Join the first four distinct causes."""
    return ", or: ".join(itertools.islice(dict.fromkeys(reasons), 4))


def _is_shown(ack: Response, frame: int) -> bool:
    return bool(ack.flags & SHOWN) and ack.frame == frame
