"""Literals of recording.md, in its order. No logic; must not know who uses them.

Named as in `wire.spec`: a table headed ``literals: GROUP`` gives ``GROUP_NAME``, one headed
``layout: NAME`` gives ``LAYOUT_NAME``. A test holds them against the document.
"""

from typing import Final

from voxdisplay.wire.spec import Layout

# Section 1: packet types of recordings, and their flags
RECORDING_TYPE_FRAME: Final = 6
RECORDING_TYPE_INDEX: Final = 7
RECORDING_TYPE_END: Final = 7
RECORDING_TYPE_META: Final = 12

RECORDING_FLAG_KEY: Final = 1
RECORDING_FLAG_LAST: Final = 1

# Section 2: the version in META
RECORDING_VERSION: Final = 1

# Section 3: FRAME
LAYOUT_FRAME: Final[Layout] = (
    ("time", 3, 4),
    ("digest", 7, 4),
    ("size", 11, 4),
    ("reserved", 15, 1),
)

# Section 4: INDEX and END
LAYOUT_INDEX: Final[Layout] = (("first", 3, 4), ("start", 7, 8))
LAYOUT_END: Final[Layout] = (("index", 3, 8), ("frames", 11, 4), ("duration", 15, 4))
