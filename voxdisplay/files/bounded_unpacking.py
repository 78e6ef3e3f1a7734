"""Unpacking of gzip, zlib and bzip2 streams up to a length: a bomb takes no more than that."""

from __future__ import annotations

import bz2
import zlib

from voxdisplay.errors import BodyError

_STEP = 1 << 20
_SMALL = 1 << 26
_RATIO = 500  # of scans it is below 10, of sparse masks some 300; deflate has 1030 at most


def check_ratio(name: str, unpacked: int, packed: int) -> None:
    """Raise `BodyError` if data are packed more densely than those of volumes and masks are.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    unpacked, packed : int
        Bytes.

    """
    if unpacked > _SMALL and unpacked > _RATIO * packed:
        raise BodyError(f"{name} would be {unpacked >> 20} MiB unpacked, from {packed} bytes")


def gunzip(name: str, data: bytes, most: int) -> bytes:
    """Return the beginning of what a gzip or zlib stream holds.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        The stream.
    most : int
        Bytes at most.

    Raises
    ------
    BodyError
        If it is damaged before that, or cut off.

    """
    return _unpack(name, data, most, lambda: zlib.decompressobj(wbits=47))


def bunzip(name: str, data: bytes, most: int) -> bytes:
    """Return the beginning of what a bzip2 stream holds: as `gunzip`."""
    return _unpack(name, data, most, bz2.BZ2Decompressor)


def _unpack(name: str, data: bytes, most: int, opened: object) -> bytes:
    found = bytearray()
    assert callable(opened)  # noqa: S101 - one of the two above
    rest = data
    try:
        while rest and len(found) < most:  # streams may follow one another
            stream = opened()
            while not stream.eof and len(found) < most:
                part = stream.decompress(rest, min(_STEP, most - len(found)))
                rest = getattr(stream, "unconsumed_tail", b"")
                found += part
                if not part and not rest and not stream.eof:
                    raise BodyError(f"{name} is cut off: its compressed data ends too early")
            rest = stream.unused_data if stream.eof else b""
    except (zlib.error, OSError, ValueError, EOFError) as error:
        raise BodyError(f"{name}: its compressed data is damaged: {error}") from None
    return bytes(found)
