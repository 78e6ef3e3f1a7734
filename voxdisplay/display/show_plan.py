"""Wire cost of a moving picture before it is sent: its worst frame, and the mean of all.

Long ones are sampled, so that the work is bounded. Must not know ports, sessions or files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from voxdisplay.display.plan import Line, Plan, Receiver, plan
from voxdisplay.frame import Frame
from voxdisplay.shows.show import EncodedShow, Show

MOST_RANKED: Final = 240
"""Frames of which the worst is found."""
MOST_PLANNED: Final = 24
"""Frames that are planned for every line."""
_RANKING: Final = Line.of_baud(1_000_000)  # fast enough that no long search is made


@dataclass(frozen=True, slots=True)
class ShowPlan:
    """Wire cost of a moving picture.

    Attributes
    ----------
    worst : int
        Number of the frame of most bytes.
    worst_frame : Frame
    worst_plans : list of Plan
        Its cost on each line.
    mean_voxels : float
        Lit voxels of a frame in the mean.
    mean_bytes : list of float
        Bytes of a frame on each line, in the mean.
    looked_at : int
        Number of frames among which the worst was found.

    """

    worst: int
    worst_frame: Frame
    worst_plans: list[Plan]
    mean_voxels: float
    mean_bytes: list[float]
    looked_at: int


def plan_show(show: Show, lines: Sequence[Line], receiver: Receiver) -> ShowPlan:
    """Return the wire cost of the frames of a show, each sent as a whole.

    Those of a recording that the receiver takes are sent as they are, by every line.

    Parameters
    ----------
    show : Show
        Of one grid and pixel format.
    lines : sequence of Line
    receiver : Receiver

    """
    ranked = _spread(show.frame_count, MOST_RANKED)
    sizes = [_plans(show, number, (_RANKING,), receiver)[0] for number in ranked]
    worst = ranked[max(range(len(ranked)), key=lambda at: sizes[at].wire_bytes)]
    planned = [
        _plans(show, number, lines, receiver) for number in _spread(show.frame_count, MOST_PLANNED)
    ]
    return ShowPlan(
        worst=worst,
        worst_frame=show.frame(worst),
        worst_plans=_plans(show, worst, lines, receiver),
        mean_voxels=sum(each.voxels for each in sizes) / len(sizes),
        mean_bytes=[
            sum(each.wire_bytes for each in of_line) / len(of_line)
            for of_line in zip(*planned, strict=True)
        ],
        looked_at=len(ranked),
    )


def _plans(show: Show, number: int, lines: Sequence[Line], receiver: Receiver) -> list[Plan]:
    """Return the cost of a frame on each line."""
    frame, encoded = show.frame(number), None
    if isinstance(show, EncodedShow):
        ready = show.encoded_frame(number, receiver.payload_bytes, receiver.features)
        encoded = None if ready is None else ready.payloads
    return [plan(frame, line, receiver, encoded) for line in lines]


def _spread(count: int, most: int) -> list[int]:
    """Return so many numbers below count, evenly spread, the first included."""
    return [i * count // min(count, most) for i in range(min(count, most))]
