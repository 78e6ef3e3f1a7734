"""Mutation of each literal of one side's ``spec.py`` by one, tested by the vectors.

    python spec_mutations.py voxdisplay.wire.spec [EXCUSED ...]
    python spec_mutations.py firmware_sim.spec [EXCUSED ...]

prints the names of the literals that no vector holds, but for those that are excused. The side's
modules are imported afresh for each literal, so that every copy of it has changed.
"""

import importlib
import importlib.util
import inspect
import itertools
import sys
from pathlib import Path

TESTS = Path(__file__).parent
DEPEND = (
    "voxdisplay.wire",
    "voxdisplay.raster.pixel_format",
    "voxdisplay.link",
    "firmware_sim",
    "vector_device",
    "drawing",
)


def purge():
    for name in list(sys.modules):
        if any(name == part or name.startswith(f"{part}.") for part in DEPEND):
            del sys.modules[name]


def vectors_pass(first=""):
    """Run the tests of the vectors, without pytest's ado, up to the first that fails.

    The tests of one function come first: what failed for one literal often fails for the next.
    Returns the name of the function whose test failed, or None.
    """
    place = importlib.util.spec_from_file_location(
        "vectors_again", TESTS / "conformance" / "test_vectors.py"
    )
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    tests = [
        (name, test)
        for name, test in inspect.getmembers(module, inspect.isfunction)
        if name.startswith("test_")
    ]
    for name, test in sorted(tests, key=lambda named: named[0] != first):
        try:
            for case in cases_of(test):
                test(**case)
        except Exception:  # noqa: BLE001 - however it fails, the literal is held
            return name
    return None


def cases_of(test):
    marks = [mark for mark in getattr(test, "pytestmark", []) if mark.name == "parametrize"]
    names = [mark.args[0] for mark in marks]
    for values in itertools.product(*(mark.args[1] for mark in marks)):
        yield dict(zip(names, values, strict=True))


def failing_test(spec_name, literal, first):
    """Return the name of a test that fails when a literal is changed by one, or None."""
    purge()
    spec = importlib.import_module(spec_name)
    value = getattr(spec, literal)
    if isinstance(value, tuple):
        (*others, (field, offset, size)) = value
        changed = (*others, (field, offset, {1: 2, 2: 4, 4: 2}[size]))
    else:
        changed = value + 1
    setattr(spec, literal, changed)
    try:
        return vectors_pass(first)
    except Exception:  # noqa: BLE001 - the modules do not even load: the literal is held
        return first


def main(spec_name, *excused):
    names = [name for name in vars(importlib.import_module(spec_name)) if name.isupper()]
    purge()
    assert vectors_pass() is None
    survivors, failed = [], ""
    for literal in names:
        if literal == "PIXEL_BYTES" or literal in excused:
            continue
        held_by = failing_test(spec_name, literal, failed)
        if held_by is None:
            survivors.append(literal)
        else:
            failed = held_by
    sys.stdout.write(" ".join(survivors) + "\n")


if __name__ == "__main__":
    sys.path.insert(0, str(TESTS))
    main(*sys.argv[1:])
