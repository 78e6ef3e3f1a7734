"""The page for browsers and its content security policy, which allows only what it needs.

The page is one file, ``page.html``, without a build step and without third-party parts. Served by
`server` it receives frames from there; in a file of `voxdisplay.view.html_export` it contains them.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import re
from importlib.resources import files


@functools.cache
def page_html() -> str:
    """Return the page."""
    return files(__package__).joinpath("page.html").read_text(encoding="utf-8")


@functools.cache
def content_security_policy(connect: str = "'none'") -> str:
    """Return the content security policy of the page.

    Parameters
    ----------
    connect : str
        Sources that it may connect to.

    """
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src {_hash('script')}",
            f"style-src {_hash('style')}",
            "img-src data:",
            f"connect-src {connect}",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


def _hash(tag: str) -> str:
    """Return the hash source of the page's inline script or style."""
    match = re.search(rf"<{tag}>(.*?)</{tag}>", page_html(), re.DOTALL)
    assert match  # noqa: S101 - it has one of each
    return f"'sha256-{base64.b64encode(hashlib.sha256(match[1].encode()).digest()).decode()}'"
