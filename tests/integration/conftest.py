"""Fixtures that several integration tests share."""

import threading

import pytest
from carriers import eventually
from pluggable_pty import Plug


@pytest.fixture
def plug(tmp_path):
    """Return a device on a pty, not plugged in yet; none of its threads outlives the test."""
    threads = threading.active_count()
    with Plug(tmp_path / "port") as plug:
        yield plug
    eventually(lambda: threading.active_count() == threads, "the end of all threads")
