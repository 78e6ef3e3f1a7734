"""Engines that render the chunks of a show: in this process, in worker processes, or on Dask.

All give the same bytes. Must not know files, nor what chunks hold.
"""

from __future__ import annotations

import multiprocessing
import pickle
import re
import signal
import socket
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from multiprocessing.context import BaseContext
from typing import Any, Protocol

from voxdisplay.errors import MissingExtra, RecordingError
from voxdisplay.shows.rendering import Rendering
from voxdisplay.shows.show import EncodedFrame

Chunk = tuple[int, int]
"""Number of the first frame, and how many."""

Rendered = tuple[Chunk, list[EncodedFrame]]

# How often a chunk is tried again after the worker that rendered it has died.
_ATTEMPTS = 3
_DASK_WAIT_S = 10
# What all workers need: the fork server imports it once.
_PRELOADED = ["voxdisplay.shows.render_engines", "voxdisplay.scene.model"]
_MAX_PORT = 65_535


class Engine(Protocol):
    """A way to render chunks."""

    def __call__(self, rendering: Rendering, chunks: Sequence[Chunk]) -> Iterator[Rendered]:
        """Yield chunks with their frames, in whatever order they are ready."""


def serial(rendering: Rendering, chunks: Sequence[Chunk]) -> Iterator[Rendered]:
    """Render chunks in this process, in their order."""
    for chunk in chunks:
        yield chunk, list(rendering.render(*chunk))


def process_pool(jobs: int) -> Engine:
    """Return an engine of worker processes.

    A worker that dies, killed or out of memory, costs the chunks that were being rendered: they are
    rendered again, each at most three times.

    """

    def render(rendering: Rendering, chunks: Sequence[Chunk]) -> Iterator[Rendered]:
        tried = dict.fromkeys(chunks, 0)
        left = list(chunks)
        while left:
            done = []
            for rendered in _render_until_broken(jobs, rendering, left, tried):
                done.append(rendered[0])
                yield rendered
            finished = set(done)
            left = [chunk for chunk in left if chunk not in finished]
            worn = [chunk for chunk in left if tried[chunk] >= _ATTEMPTS]
            if worn:
                raise RecordingError(
                    f"frames {worn[0][0]} to {sum(worn[0]) - 1}: the worker process died "
                    f"{_ATTEMPTS} times",
                    hint="it may lack memory: take fewer --jobs",
                )

    return render


def _render_until_broken(
    jobs: int, rendering: Rendering, chunks: Sequence[Chunk], tried: dict[Chunk, int]
) -> Iterator[Rendered]:
    """Yield chunks until all are rendered or a worker dies; count how often each was begun."""
    context = _worker_context()
    pool = ProcessPoolExecutor(
        jobs, mp_context=context, initializer=_init_worker, initargs=(rendering,)
    )
    ended = False
    try:
        # No more than are worked at, and one to come, so that few are lost with a worker.
        waiting = list(reversed(chunks))
        running: dict[Future[list[EncodedFrame]], Chunk] = {}
        while waiting or running:
            while waiting and len(running) <= jobs:
                chunk = waiting.pop()
                tried[chunk] += 1
                running[pool.submit(_render_in_worker, chunk)] = chunk
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                chunk = running.pop(future)
                yield chunk, future.result()
        ended = True
    except BrokenProcessPool:
        ended = True
    finally:
        pool.shutdown(wait=ended, cancel_futures=True)


def _worker_context() -> BaseContext:
    """Return how workers are started: no fork of this process, which would copy threads' locks.

    A fork server is the process's own: one that runs already is used as it is.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    return context


class _Worker:
    """State of a worker process."""

    rendering: Rendering | None = None


def _init_worker(rendering: Rendering) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends its workers
    _Worker.rendering = rendering


def _render_in_worker(chunk: Chunk) -> list[EncodedFrame]:
    assert _Worker.rendering is not None  # noqa: S101 - by the initializer
    return list(_Worker.rendering.render(*chunk))


def dask_scheduler(address: str) -> Engine:
    """Return an engine of the workers of a Dask scheduler (extra ``farm``).

    Parameters
    ----------
    address : str
        Such as ``tcp://127.0.0.1:8786``.

    """

    def render(rendering: Rendering, chunks: Sequence[Chunk]) -> Iterator[Rendered]:
        try:
            import distributed  # noqa: PLC0415 - an extra
        except ImportError as error:
            raise MissingExtra(
                "rendering on Dask needs the library distributed",
                hint="pip install 'voxdisplay[farm]'",
            ) from error
        pickled = pickle.dumps(rendering)
        with _connected(distributed, address) as client:
            futures = {
                client.submit(_render_pickled, pickled, chunk, retries=2, pure=False): chunk
                for chunk in chunks
            }
            for future in distributed.as_completed(list(futures), loop=client.loop):
                chunk = futures.pop(future)
                yield chunk, _result(distributed, future, chunk)
                future.release()

    return render


def _connected(distributed: Any, address: str) -> Any:
    """Return a client of a scheduler that has workers."""
    hint = "start one: dask scheduler, and dask worker ADDRESS on each machine"
    match = re.fullmatch(r"(?:(?:tcp|tls)://)?\[?([^\[\]/]+?)\]?:([0-9]{1,5})", address)
    if match is None or int(match[2]) > _MAX_PORT:
        raise RecordingError(
            f"{address!r} is no address of a Dask scheduler", hint="write tcp://HOST:8786"
        )
    try:
        # The library would try again and again until its time is over.
        socket.create_connection((match[1], int(match[2])), _DASK_WAIT_S).close()
        client = distributed.Client(address, timeout=_DASK_WAIT_S, set_as_default=False)
    except Exception as error:  # its reader of addresses raises anything
        raise RecordingError(f"no Dask scheduler answers at {address}", hint=hint) from error
    try:
        client.wait_for_workers(1, timeout=_DASK_WAIT_S)
    except TimeoutError as error:
        client.close()
        raise RecordingError(
            f"the Dask scheduler at {address} has no workers", hint=hint
        ) from error
    return client


def _result(distributed: Any, future: Any, chunk: Chunk) -> list[EncodedFrame]:
    try:
        frames: list[EncodedFrame] = future.result()
    except distributed.KilledWorker as error:
        raise RecordingError(
            f"frames {chunk[0]} to {sum(chunk) - 1}: each worker that rendered them died",
            hint="it may lack memory: look at the worker's own messages",
        ) from error
    return frames


@lru_cache(maxsize=2)
def _unpickled(pickled: bytes) -> Rendering:
    rendering: Rendering = pickle.loads(pickled)  # noqa: S301 - from the client that set the task
    return rendering


def _render_pickled(pickled: bytes, chunk: Chunk) -> list[EncodedFrame]:
    return list(_unpickled(pickled).render(*chunk))
