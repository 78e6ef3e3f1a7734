"""Literals of protocol.md, in its order. No logic; must not know who uses them.

A table of the document that is headed ``literals: GROUP`` gives constants ``GROUP_NAME``; one
headed ``layout: NAME`` gives ``LAYOUT_NAME``, a tuple of (field, offset, size in bytes). The
emulator has a transcription of its own; a test holds both against the document.
"""

from typing import Final

Layout = tuple[tuple[str, int, int], ...]

# Section 2.1: pixel formats, and the bytes of a pixel of each
FORMAT_MONO1: Final = 1
FORMAT_INDEX8: Final = 2
FORMAT_RGB565: Final = 3
FORMAT_RGB888: Final = 4
PIXEL_BYTES: Final = {FORMAT_MONO1: 1, FORMAT_INDEX8: 1, FORMAT_RGB565: 2, FORMAT_RGB888: 3}

# Section 4: the header, the check value, the types
LAYOUT_HEADER: Final[Layout] = (("kind", 0, 1), ("seq", 1, 1), ("frame", 2, 1))

CRC_WIDTH: Final = 32
CRC_POLY: Final = 0x04C11DB7
CRC_INIT: Final = 0xFFFFFFFF
CRC_REFIN: Final = 1
CRC_REFOUT: Final = 1
CRC_XOROUT: Final = 0xFFFFFFFF
CRC_CHECK: Final = 0xCBF43926

TYPE_DATA: Final = 1
TYPE_HELLO: Final = 3
TYPE_STATUS: Final = 4
TYPE_READ: Final = 5
TYPE_ACK: Final = 8
TYPE_INFO: Final = 9
TYPE_PAGE: Final = 10
TYPE_ERROR: Final = 11

# Section 5: HELLO, INFO, features
LAYOUT_HELLO: Final[Layout] = (
    ("major", 3, 1),
    ("session", 4, 2),
    ("minor", 6, 1),
    ("reserved", 7, 1),
)
LAYOUT_INFO: Final[Layout] = (
    ("major", 3, 1),
    ("session", 4, 2),
    ("boot", 6, 2),
    ("minor", 8, 1),
    ("format", 9, 1),
    ("nx", 10, 2),
    ("ny", 12, 2),
    ("nz", 14, 2),
    ("pages", 16, 1),
    ("reserved", 17, 1),
    ("max_payload", 18, 2),
    ("rx_buffer", 20, 4),
    ("refresh", 24, 4),
    ("features", 28, 4),
)
FEATURE_LINE: Final = 0
FEATURE_BOX: Final = 1
FEATURE_DOTS: Final = 2
FEATURE_OCT: Final = 3
FEATURE_DIFF: Final = 4
FEATURE_ARC: Final = 5
FEATURE_PALETTE: Final = 6
FEATURE_READ: Final = 7
FEATURE_DIGEST: Final = 8
FEATURE_SLABS: Final = 9
FEATURE_FADE: Final = 10
FEATURE_ARC2: Final = 11
FEATURE_HOLD: Final = 12
FEATURE_VALUES: Final = 13

# Section 6: DATA
DATA_FLAG_CLEAR: Final = 1
DATA_FLAG_COMMIT: Final = 4

# Section 7: ops
OP_END: Final = 0x00
OP_PEN: Final = 0x01
OP_MOVE: Final = 0x02
OP_LINE: Final = 0x03
OP_BOX: Final = 0x04
OP_DOTS: Final = 0x05
OP_COLORS: Final = 0x06
OP_HOLD: Final = 0x07
OP_FADE: Final = 0x08
OP_RAMP: Final = 0x09
OP_STEP: Final = 0x20
OP_FROM: Final = 0x40
OP_ARC: Final = 0x58
OP_SLABS: Final = 0x59
OP_ARC2: Final = 0x5A
OP_VALUES: Final = 0x5B
OP_OCT: Final = 0x60
OP_SKIP: Final = 0x80
OP_RUN: Final = 0xA0
OP_LIT: Final = 0xC0
OP_DIFF: Final = 0xE0

# Section 7.7: range-coded chains
ARC_MORE: Final = 0
ARC_JUMP: Final = 1
ARC_INK: Final = 2
ARC_COUNT: Final = 3
ARC_LONE: Final = 18
ARC_TURN: Final = 26
ARC_MAIN: Final = 42
ARC_HISTORY: Final = 74
ARC_RUNS: Final = 138
ARC_MODELS: Final = 266
ARC_HALF: Final = 2048
ARC_ENOUGH: Final = 6
ARC_BEHIND: Final = 3
ARC_MAX_K: Final = 15
ARC_MAX_RUN: Final = 255

# Section 7.10: more range-coded chains
ARC2_NEAR: Final = 266
ARC2_FADE: Final = 267
ARC2_DELTA: Final = 268
ARC2_MODELS: Final = 298
ARC2_MAX_DELTA: Final = 30
ARC2_MAX_SIDE: Final = 1024

# Section 7.11: range-coded slabs
SLABS_MORE: Final = 0
SLABS_NEXT: Final = 1
SLABS_FLAG: Final = 2
SLABS_FULL: Final = 258
SLABS_GROUP: Final = 322
SLABS_SHAPE: Final = 386
SLABS_MODELS: Final = 2434
SLABS_ENOUGH: Final = 6
SLABS_PACE: Final = 3
SLABS_CELL: Final = 4
SLABS_SIDE_BITS: Final = 4

# Section 7.13: range-coded pixel values
VALUES_COPY: Final = 2434
VALUES_CHANNEL: Final = 2818
VALUES_MODELS: Final = 4186
VALUES_ZERO: Final = 0
VALUES_SIGN: Final = 8
VALUES_MAGNITUDE: Final = 16
VALUES_LONG: Final = 144
VALUES_SET: Final = 152
VALUES_PACE: Final = 2
VALUES_SIDE_BITS: Final = 3
VALUES_WEIGHT_BITS: Final = 7
VALUES_MAX_UNARY: Final = 15
VALUES_MAX_LONG: Final = 7
VALUES_MAX_CLASS: Final = 7

# Section 8: the digest
DIGEST_MUL_INDEX: Final = 0x9E3779B1
DIGEST_MUL_VALUE: Final = 0x85EBCA77
DIGEST_SHIFT_1: Final = 15
DIGEST_MUL_1: Final = 0x2C1B3C6D
DIGEST_SHIFT_2: Final = 12
DIGEST_MUL_2: Final = 0x297A2D39
DIGEST_SHIFT_3: Final = 15

# Section 9: ACK
LAYOUT_ACK: Final[Layout] = (
    ("last", 3, 1),
    ("session", 4, 2),
    ("boot", 6, 2),
    ("received", 8, 4),
    ("credit", 12, 4),
    ("digest", 16, 4),
    ("damaged", 20, 2),
)
ACK_FLAG_SHOWN: Final = 1
ACK_FLAG_PENDING: Final = 2
ACK_FLAG_ASKED: Final = 4

# Section 10: READ and PAGE
LAYOUT_READ: Final[Layout] = (("reserved", 3, 1), ("start", 4, 4), ("count", 8, 4))
READ_FLAG_BACK: Final = 1
LAYOUT_PAGE: Final[Layout] = (("reserved", 3, 1), ("start", 4, 4), ("count", 8, 4))

# Section 11: ERROR
LAYOUT_ERROR: Final[Layout] = (("code", 3, 1), ("session", 4, 2), ("offset", 6, 2))
CODE_NO_SESSION: Final = 1
CODE_TYPE: Final = 2
CODE_LENGTH: Final = 3
CODE_FIELD: Final = 4
CODE_SEQUENCE: Final = 5
CODE_FRAME: Final = 6
CODE_OP: Final = 7
CODE_COUNT: Final = 8
CODE_TRUNCATED: Final = 9
CODE_PADDING: Final = 10
CODE_PIXEL: Final = 11
CODE_OUTSIDE: Final = 12
CODE_OVERRUN: Final = 13

# Section 14: limits
LIMIT_WINDOW: Final = 32
LIMIT_MIN_SEGMENT: Final = 8
LIMIT_OVERHEAD: Final = 7
LIMIT_RESERVE: Final = 64
LIMIT_MIN_PAYLOAD: Final = 64
LIMIT_MAX_PAYLOAD: Final = 65535
LIMIT_MAX_SIDE: Final = 65535
LIMIT_MAX_VOXELS: Final = 0x7FFFFFFF
LIMIT_MAX_STEPS: Final = 256
LIMIT_MAX_OCTANT: Final = 23
LIMIT_MAX_DOTS: Final = 256
LIMIT_MAX_LEVEL: Final = 4
LIMIT_MAX_COLORS: Final = 256
LIMIT_MAX_FADE: Final = 0x100000
LIMIT_MAX_HOLD: Final = 255
LIMIT_MAX_HELD: Final = 1000
LIMIT_MAX_STATUS: Final = 4
LIMIT_MAX_SILENT: Final = 8

# Section 15: versions
VERSION_MAJOR: Final = 1
VERSION_MINOR: Final = 1

# Section 16.1: USB
USB_CLASS: Final = 0xFF
USB_SUBCLASS: Final = 0x56
USB_PROTOCOL: Final = 0x58
USB_TEST_VENDOR: Final = 0x1209
USB_TEST_PRODUCT: Final = 0x0001
