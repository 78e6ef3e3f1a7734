import gc

import pytest

from voxdisplay.compute.garbage_collection import collecting_between, garbage_collection_paused


def test_the_collector_is_paused_while_a_part_is_made_and_used() -> None:
    seen = []

    def parts():
        for k in range(3):
            seen.append(gc.isenabled())
            yield k

    for part in collecting_between(parts()):
        seen.append(gc.isenabled())
        assert part == len(seen) // 2 - 1
    assert seen == [False] * 6
    assert gc.isenabled()


@pytest.mark.parametrize("fails", ["making", "using"])
def test_the_collector_goes_on_after_an_error(fails: str) -> None:
    def parts():
        yield 1
        if fails == "making":
            raise KeyError

    def use() -> None:
        for _ in collecting_between(parts()):
            if fails == "using":
                raise KeyError

    with pytest.raises(KeyError):
        use()
    assert gc.isenabled()


def test_it_runs_between_two_parts() -> None:
    runs: list[str] = []

    def callback(phase: str, _info: object) -> None:
        runs.append(phase)

    gc.callbacks.append(callback)
    try:
        for _ in collecting_between(range(3)):
            before = len(runs)
            held = [[] for _ in range(10 * gc.get_threshold()[0])]
            assert len(runs) == before
            assert held
        assert runs
    finally:
        gc.callbacks.remove(callback)


def test_a_collector_that_is_off_stays_off() -> None:
    gc.disable()
    try:
        assert list(collecting_between("ab")) == ["a", "b"]
        with garbage_collection_paused():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
