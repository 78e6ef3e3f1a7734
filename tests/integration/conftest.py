"""Fixtures that several integration tests share."""

import threading

import browser as browsers
import pytest
from carriers import eventually
from pluggable_pty import Plug


@pytest.fixture
def plug(tmp_path):
    """Return a device on a pty, not plugged in yet; none of its threads outlives the test."""
    before = set(threading.enumerate())  # one of an earlier test may be ending
    with Plug(tmp_path / "port") as plug:
        yield plug
    eventually(lambda: before.issuperset(threading.enumerate()), "the end of all threads")


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    browser = browsers.Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.fixture
def tab(chromium):
    """Open tabs; in the end nothing may have gone wrong in any, nor been asked for elsewhere."""
    tabs = []

    def open_tab(url, **look):
        tabs.append(chromium.tab(url, **look))
        return tabs[-1]

    yield open_tab
    for tab in tabs:
        assert tab.errors == []
        assert all(
            url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "file:", "blob:", "data:"))
            for url in tab.requests
        ), tab.requests
        tab.close()
