"""The page for browsers and its content security policy, which allows only what it needs.

The page is plain HTML, CSS and JavaScript in ``browser/``, without a build step and without
third-party parts; here its files are put into one. Served by `server` it receives frames from
there; in a file of `voxdisplay.view.html_export` it contains them.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import re
from importlib.resources import files

_LINKED = re.compile(
    r'<link rel="(?P<style>stylesheet)" href="(?P<css>[a-z]+\.css)">'
    r'|<script src="(?P<js>[a-z]+\.js)"></script>'
)
# Indentation, and lines that are but a comment, are not sent.
_COMMENTS = re.compile(r"^[ \t]*//.*\n|^[ \t]+|^\n", re.MULTILINE)


@functools.cache
def page_html() -> str:
    """Return the page: ``page.html`` with the files that it links in the place of the links."""
    return _LINKED.sub(_inlined, _read("page.html"))


def _inlined(link: re.Match[str]) -> str:
    tag = "style" if link["style"] else "script"
    text = _COMMENTS.sub("", _read(link["css"] or link["js"]))
    return f"<{tag}>\n{text}</{tag}>"


def _read(name: str) -> str:
    return files(__package__).joinpath("browser", name).read_text(encoding="utf-8")


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
            f"script-src {_hashes('script')}",
            f"style-src {_hashes('style')}",
            "img-src data:",
            f"connect-src {connect}",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


def _hashes(tag: str) -> str:
    """Return the hash sources of the page's inline scripts or styles."""
    texts = re.findall(rf"<{tag}>(.*?)</{tag}>", page_html(), re.DOTALL)
    digests = (hashlib.sha256(text.encode()).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
