"""Parallel map: order, errors, interrupts, and voxels independent of the processors."""

import gc
import subprocess
import sys
import threading
from importlib import import_module

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.compute import kernel_backend, parallel
from voxdisplay.curves import Bezier, Circle, Curve, Segment, Transformed
from voxdisplay.curves.batch_evaluation import BLOCK_SIZE, MIN_PARALLEL_BLOCKS, BatchEvaluator
from voxdisplay.errors import CurveError
from voxdisplay.voxelization import voxelize, voxelize_many

PATIENCE_S = 20
# The package has a function of this name.
DIGITISE = import_module("voxdisplay.voxelization.digitise")


@pytest.fixture(autouse=True)
def three_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "cpu_count", lambda: 3)
    monkeypatch.setattr(kernel_backend, "enabled", lambda: True)  # what batches are done apart for


def beziers(count: int) -> list[Curve]:
    rng = np.random.default_rng(4)
    return [Bezier(rng.uniform(0, 40, (4, 3))) for _ in range(count)]


def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "cpu_count", lambda: 1)


def test_parts_are_done_at_once_and_come_in_order() -> None:
    meet = threading.Barrier(3, timeout=PATIENCE_S)  # breaks if fewer than three get there

    def square(part: int) -> int:
        meet.wait()
        return part * part

    assert list(parallel.ordered_map(square, range(9))) == [part * part for part in range(9)]


def test_a_part_is_not_divided() -> None:
    def idents(_: int) -> set[int]:
        inner = parallel.ordered_map(lambda _: threading.get_ident(), range(5))
        return {threading.get_ident(), *inner}

    found = list(parallel.ordered_map(idents, range(6)))
    assert all(len(each) == 1 for each in found)
    assert {threading.get_ident()} not in found


def test_one_part_or_one_processor_needs_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    here = threading.get_ident()
    assert list(parallel.ordered_map(lambda _: threading.get_ident(), [0])) == [here]
    alone(monkeypatch)
    assert list(parallel.ordered_map(lambda _: threading.get_ident(), range(4))) == [here] * 4


@pytest.mark.parametrize("begun", [0, 1])
def test_where_no_thread_may_begin_all_is_done_in_this_one(
    monkeypatch: pytest.MonkeyPatch, begun: int
) -> None:
    monkeypatch.setattr(parallel, "cpu_count", lambda: 3)
    start, left = threading.Thread.start, iter(range(begun))

    def refused(thread: threading.Thread) -> None:
        if next(left, None) is None:
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refused)
    assert list(parallel.ordered_map(lambda part: part * part, [3, 5, 7])) == [9, 25, 49]


def test_what_is_done_when_the_program_ends_is_done_without_threads() -> None:
    program = (
        "import atexit; from voxdisplay.compute import parallel; parallel.cpu_count = lambda: 3; "
        "atexit.register(lambda: print(*parallel.ordered_map(abs, [-3, 5, -7])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("3 5 7\n", "")


def test_the_first_error_in_order_is_raised() -> None:
    second_failed = threading.Event()

    def fail(part: int) -> int:
        if part == 1:
            second_failed.wait(PATIENCE_S)
        if part == 2:
            second_failed.set()
        if part:
            raise ValueError(part)
        return part

    results = parallel.ordered_map(fail, range(30))
    assert next(results) == 0
    with pytest.raises(ValueError, match=r"^1$"):
        next(results)


def test_there_is_at_least_one_processor() -> None:
    assert parallel.cpu_count() >= 1


def test_batches_are_the_same_on_any_number_of_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DIGITISE, "MAX_BATCH_CURVES", 7)
    curves = beziers(80)
    many = voxelize_many(curves)
    alone(monkeypatch)
    for one, other in zip(many, voxelize_many(curves), strict=True):
        assert one.voxels.tobytes() == other.voxels.tobytes()
        assert one.t.tobytes() == other.t.tobytes()


@pytest.mark.parametrize("worth", [True, False])
def test_batches_are_done_apart_where_it_is_worth_it(
    worth: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(DIGITISE, "MAX_BATCH_CURVES", 4)
    monkeypatch.setattr(kernel_backend, "enabled", lambda: worth)
    asked: set[int] = set()

    class Own(Segment):
        thread_safe = True

        def position(self, t: np.ndarray) -> np.ndarray:
            asked.add(threading.get_ident())
            return super().position(t)

    voxelize_many([Own((0, 0, 0), (9, 4, 7))] * 40)
    assert (asked != {threading.get_ident()}) == worth


@pytest.mark.parametrize("curve", ["formula", "circle", "bezier"])
def test_a_long_curve_is_the_same_on_any_number_of_processors(
    curve: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("voxdisplay.voxelization.plane_crossings.BLOCK", 50)
    monkeypatch.setattr("voxdisplay.curves.batch_evaluation.BLOCK_SIZE", 30)
    long = {
        "formula": vd.Parametric("99*cos(t)", "99*sin(t)", "50*sin(3*t)", t=(0, 6)),
        "circle": Circle((70, 70, 70), 60),
        "bezier": beziers(1)[0],
    }[curve]
    many = voxelize(Transformed(long, 3.0))
    alone(monkeypatch)
    one = voxelize(Transformed(long, 3.0))
    assert one.voxels.tobytes() == many.voxels.tobytes()
    assert one.t.tobytes() == many.t.tobytes()


@pytest.mark.parametrize("on", [True, False])
def test_the_collector_of_garbage_is_left_as_it_was(*, on: bool) -> None:
    was_on = gc.isenabled()
    (gc.enable if on else gc.disable)()
    try:
        voxelize_many(beziers(40))
        assert gc.isenabled() == on
    finally:
        (gc.enable if was_on else gc.disable)()


def test_an_interrupt_leaves_the_collector_of_garbage_on(monkeypatch: pytest.MonkeyPatch) -> None:
    disable = gc.disable

    def interrupted() -> None:
        disable()
        raise KeyboardInterrupt  # as soon as the call is over

    was_on = gc.isenabled()
    gc.enable()
    monkeypatch.setattr(gc, "disable", interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            voxelize_many(beziers(4))
        assert gc.isenabled()
    finally:
        (gc.enable if was_on else disable)()


def test_the_first_bad_curve_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DIGITISE, "MAX_BATCH_CURVES", 4)
    far = Segment((0, 0, 0), (3e9, 0, 0))
    curves = [*beziers(40), far, *beziers(9), far]
    with pytest.raises(CurveError, match=r"^curve 40: x = .* is too far out"):
        voxelize_many(curves)


def test_what_may_not_be_asked_from_several_threads_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DIGITISE, "MAX_BATCH_CURVES", 4)
    monkeypatch.setattr("voxdisplay.voxelization.plane_crossings.BLOCK", 50)
    asked: set[int] = set()

    def position(t: np.ndarray) -> np.ndarray:
        asked.add(threading.get_ident())
        return 300 * np.stack((t, t * t, t**3))

    class Own(Segment):
        def position(self, t: np.ndarray) -> np.ndarray:
            return position(t)

    called = vd.Parametric(position, t=(0, 1))
    own = Own((0, 0, 0), (1, 1, 1))
    assert not any(each.thread_safe for each in (called, own, Transformed(own, 2.0)))
    assert all(each.thread_safe for each in (*beziers(1), Transformed(Circle((0, 0, 0), 1), 2.0)))
    voxelize_many([called, own, Transformed(own, 2.0)] * 12)
    assert asked == {threading.get_ident()}


def test_many_points_of_one_curve_are_found_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    meet = threading.Barrier(2, timeout=PATIENCE_S)

    class Meeting(Segment):
        thread_safe = True

        def position(self, t: np.ndarray) -> np.ndarray:
            meet.wait()  # breaks if there is nobody else to ask
            return super().position(t)

    monkeypatch.setattr(parallel, "cpu_count", lambda: 2)
    curves = BatchEvaluator([Meeting((0, 0, 0), (9, 9, 9))])
    t = np.linspace(0, 1, MIN_PARALLEL_BLOCKS * BLOCK_SIZE)
    points = curves.positions(np.zeros(t.size, dtype=np.int64), t)
    assert np.array_equal(points, Segment((0, 0, 0), (9, 9, 9)).position(t))
