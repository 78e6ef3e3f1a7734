"""Recording on a real Dask scheduler with two worker processes."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from recordings import Spin, recording_format, write_recording

from voxdisplay.errors import RecordingError
from voxdisplay.shows.record import record
from voxdisplay.shows.render_engines import dask_scheduler
from voxdisplay.shows.rendering import Rendering

pytest.importorskip("distributed")
WAIT_S = 60
TESTS = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def farm(tmp_path_factory):
    """Start a scheduler and two workers; yield the address, and a function that starts a worker."""
    folder = tmp_path_factory.mktemp("farm")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    program = [sys.executable, "-m", "dask"]
    common = ["--host", "127.0.0.1", "--no-dashboard"]
    variables = {**os.environ, "PYTHONPATH": str(TESTS)}
    with ExitStack() as stack:

        def start(*arguments):
            process = subprocess.Popen(
                [*program, *arguments, *common],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=folder,
                env=variables,
            )
            stack.callback(process.wait)
            stack.callback(process.kill)

        def start_worker():
            start("worker", address, "--nthreads", "1", "--no-nanny")

        start("scheduler", "--port", str(port))
        until_s = time.monotonic() + WAIT_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                assert time.monotonic() < until_s, "the scheduler did not start"
                time.sleep(0.1)
        start_worker()
        start_worker()
        yield address, start_worker


@pytest.mark.parametrize("chunk_frames", [1, 5, 20, 60])
def test_the_same_bytes_as_in_one_process(farm, tmp_path, chunk_frames):
    show = Spin()
    write_recording(tmp_path / "serial.vxs", show)
    path = tmp_path / "a.vxs"
    rendering = Rendering(show, recording_format(show))
    record(rendering, path, engine=dask_scheduler(farm[0]), chunk_frames=chunk_frames)
    assert path.read_bytes() == (tmp_path / "serial.vxs").read_bytes()


def test_a_worker_that_dies(farm, tmp_path):
    address, start_worker = farm
    start_worker()
    show = Spin(dies_once=str(tmp_path / "died"))
    write_recording(tmp_path / "serial.vxs", Spin())
    path = tmp_path / "a.vxs"
    rendering = Rendering(show, recording_format(show))
    record(rendering, path, engine=dask_scheduler(address), chunk_frames=8)
    assert (tmp_path / "died").exists()
    assert path.read_bytes() == (tmp_path / "serial.vxs").read_bytes()


def test_no_scheduler(tmp_path):
    show = Spin()
    with pytest.raises(RecordingError, match="no Dask scheduler answers at tcp:"):
        record(
            Rendering(show, recording_format(show)),
            tmp_path / "a.vxs",
            engine=dask_scheduler("tcp://127.0.0.1:9"),
        )
