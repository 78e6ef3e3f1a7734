"""Shows bound to a display: frames made elsewhere stand as the display does."""

import voxdisplay as vd
from voxdisplay.shows.playable import bind_show


class OneFrame:
    """A show of one frame."""

    duration, fps, loop, frame_count = 0.5, 2.0, True, 1

    def __init__(self, frame):
        self._frame = frame

    def frame(self, number):
        assert number == 0
        return self._frame


def test_frames_made_elsewhere_are_turned():
    with vd.open("sim:?size=3x5x7", display={"axes": ["x", "-z", "y"]}) as display:
        blank = display.frame()
    upright = blank.with_output(None)
    upright.draw([(0, 1, 2)])
    bound = bind_show(OneFrame(upright), blank, "contain")
    assert (bound.duration, bound.fps, bound.loop, bound.frame_count) == (0.5, 2.0, True, 1)
    assert bound.frame(0).output == blank.output
    assert bound.frame(0).digest != upright.digest
    assert bound.frame(0) == upright
