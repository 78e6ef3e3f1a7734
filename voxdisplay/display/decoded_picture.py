"""Pictures that were encoded ahead, as frames again: for displays that cut or convert them.

Must not know how a frame is sent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from voxdisplay.frame import Frame
from voxdisplay.shows.show import EncodedFrame
from voxdisplay.wire.op_decoder import decode_ops

if TYPE_CHECKING:
    from voxdisplay.display.device_info import DeviceInfo
    from voxdisplay.display.frame_queue import Picture


def decoded_picture(picture: Picture, info: DeviceInfo) -> Frame:
    """Return a picture as a frame of a display; a frame as it is."""
    if not isinstance(picture, EncodedFrame):
        return picture
    frame = Frame(info.grid, info.format)
    drawn = decode_ops(picture.payloads, frame.grid, frame.format)
    frame.set_voxels(drawn.index, drawn.values)
    return frame
