"""The page that browsers get, and what it may do: nothing but what it does.

It is one file, ``page.html``, without a build step and without anything from elsewhere. Served by
`server` it asks for frames there; written into a file by `voxdisplay.view.html_export` it has them.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import re
from importlib.resources import files


@functools.cache
def page_html() -> str:
    """Give the page."""
    return files(__package__).joinpath("page.html").read_text(encoding="utf-8")


@functools.cache
def content_security_policy(connect: str = "'none'") -> str:
    """Give the content security policy under which the page works.

    Parameters
    ----------
    connect : str
        Where it may connect to.

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
    """Name the one inline script or style that is ours."""
    match = re.search(rf"<{tag}>(.*?)</{tag}>", page_html(), re.DOTALL)
    assert match  # noqa: S101 - the page is ours too
    return f"'sha256-{base64.b64encode(hashlib.sha256(match[1].encode()).digest()).decode()}'"
