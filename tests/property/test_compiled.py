"""Equality of kernels and numpy functions to the last bit, and the choice between them."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain

import numpy as np
import pytest
from guarantees import KINDS, profile
from space_curves import Function

import voxdisplay as vd
from voxdisplay.compute import kernel_backend
from voxdisplay.curves import Bezier, Curve
from voxdisplay.voxelization.index_ranges import insert_columns
from voxdisplay.voxelization.thinning import thin_events
from voxdisplay.voxelization.voxel_events import VoxelEvents

pytest.importorskip("numba")

# The judge is not asked here: all it takes is drawing them twice.
MANY = 150


@contextmanager
def kernels(choice: bool) -> Iterator[None]:
    before = kernel_backend.set_enabled(choice)
    try:
        yield
    finally:
        kernel_backend.set_enabled(before)


def same(curves: list[Curve], *, certified: bool = False) -> None:
    with kernels(False):
        plain = vd.voxelize_many(curves, certified=certified)
    with kernels(True):
        fast = vd.voxelize_many(curves, certified=certified)
    for one, other in zip(plain, fast, strict=True):
        assert one.voxels.tobytes() == other.voxels.tobytes()
        assert one.t.tobytes() == other.t.tobytes()
        assert one.starts.tobytes() == other.starts.tobytes()
        assert (one.closed, one.proof) == (other.closed, other.proof)


@pytest.mark.parametrize("kind", KINDS)
def test_the_profile(kind: str) -> None:
    same(profile(kind, 20 if kind.startswith("rough") else MANY))


def test_all_kinds_in_one_batch() -> None:
    same(list(chain.from_iterable(profile(kind, 8) for kind in KINDS)))


def test_curves_that_jump_or_stand_still() -> None:
    def step(seed: int) -> Curve:
        at, height = np.random.default_rng(seed).uniform(-0.1, 1.1), 5.0 * seed
        return Function(lambda t: (40 * t, height * (t > at), 7 * np.sin(9 * t)))

    same([step(seed) for seed in range(40)])
    same([Function(lambda _: (3.2, 4.4, 5.6)), Function(lambda t: (np.floor(9 * t), 0.5, 0.5))])


def test_beziers_of_any_degree() -> None:
    rng = np.random.default_rng(5)
    for points in (2, 3, 4, 5, 9, 65):
        same([Bezier(rng.uniform(0, 60, (points, 3))) for _ in range(30)])


def test_certified_curves() -> None:
    texts = [("64 + 20*cos(t)", f"64 + 20*sin({k}*t)", "64 + 3*cos(40*t)") for k in range(1, 5)]
    same([vd.Parametric(*text, t=(0, 6)) for text in texts], certified=True)


@pytest.mark.parametrize("tips", [False, True])
@pytest.mark.parametrize("seed", range(30))
def test_thinning_walks_that_repeat_and_leap(seed: int, tips: bool) -> None:
    rng = np.random.default_rng(seed)
    steps = rng.integers(-1, 2, (3, 500)) * rng.choice([1, 1, 1, 1, 1, 4], 500)
    steps[:, rng.random(500) < 0.3] = (np.arange(3) == 0)[:, None]  # straight, for a while
    events = VoxelEvents(
        np.sort(rng.integers(0, 4, 500)).astype(np.int32),
        np.sort(rng.uniform(0, 1, 500)),
        np.cumsum(steps, axis=1).astype(np.int32),
        rng.choice([-1, 0, 0, 0, 0, 0, 0, 2], 500).astype(np.int8),
    )
    with kernels(False):
        plain = thin_events(events, keep_tips=tips)
    with kernels(True):
        fast = thin_events(events, keep_tips=tips)
    for name in ("piece", "t", "voxels", "heading"):
        assert np.array_equal(getattr(plain, name), getattr(fast, name))


@pytest.mark.parametrize("at", [[], [0], [0, 0, 3, 7, 7], [7]])
def test_insertion(at: list[int]) -> None:
    where, rows = np.array(at, dtype=np.int64), np.arange(21.0).reshape(3, 7)
    fresh = -np.arange(3.0 * len(at)).reshape(3, -1)
    for choice in (False, True):
        with kernels(choice):
            merged, line = insert_columns(where, (rows, rows[0]), (fresh, fresh[0]))
        assert np.array_equal(merged, np.insert(rows, where, fresh, axis=1))
        assert np.array_equal(line, merged[0])


@pytest.mark.parametrize(("break_even", "loaded"), [(10, True), (1000, False)])
def test_numba_is_imported_where_it_pays_and_not_before(break_even: int, loaded: bool) -> None:
    script = f"""
import sys
import voxdisplay as vd
from voxdisplay.compute import kernel_backend
kernel_backend.BREAK_EVEN_SAMPLES = {break_even}
sequence = vd.voxelize(vd.Parametric("40*cos(t)", "40*sin(t)", "0", t=(0, 3)))
print("numba" in sys.modules, len(sequence))
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.split() == [str(loaded), "109"]


def test_an_interrupt_waits_for_the_compiler():
    done, before = [], signal.getsignal(signal.SIGINT)

    @kernel_backend.deferred_interrupts()
    def work():
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done
    assert signal.getsignal(signal.SIGINT) is before


def test_without_an_interrupt_nothing_is_changed():
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(ValueError, match="its own"), kernel_backend.deferred_interrupts():
        raise ValueError("its own")
    assert signal.getsignal(signal.SIGINT) is before


def test_in_another_thread_no_interrupt_can_come():
    done = []

    def work():
        with kernel_backend.deferred_interrupts():
            done.append(1)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done
