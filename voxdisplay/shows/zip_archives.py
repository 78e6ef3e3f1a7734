"""Damage of ZIP archives, as `zipfile` reports it. Must not know what archives hold."""

from __future__ import annotations

import zipfile
import zlib
from typing import Final

ARCHIVE_DAMAGE: Final = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    NotImplementedError,  # an unknown compression
    RuntimeError,  # encryption
    OSError,  # a place before the file's beginning
    ValueError,  # a name that is no text
)
"""Exceptions of `zipfile` for damaged archives, beside those for unreadable files."""
