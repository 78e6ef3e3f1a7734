"""Values of wrong kinds, and the judgement of errors: raised on purpose, or from inside."""

import ast
import math
import traceback
from functools import cache
from pathlib import Path

import numpy as np

import voxdisplay as vd

PACKAGE = Path(vd.__file__).parent

WRONG = {
    "None": None,
    "True": True,
    "whole number": 7,
    "negative": -3,
    "huge": 1 << 80,
    "larger than any float": 10**400,
    "fraction": 1.5,
    "nan": math.nan,
    "infinity": -math.inf,
    "complex": 1 + 2j,
    "numpy number": np.float32(2.5),
    "text": "xyz",
    "empty text": "",
    "control characters": "\x1b[2J\0\n",
    "bytes": b"xyz",
    "empty list": [],
    "list": [1, 2],
    "triple": (1, 2, 3),
    "texts": ["a", "b", "c"],
    "ragged": [[1, 2, 3], [1, 2]],
    "Nones": [None, None, None],
    "points": [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)],
    "dict": {"a": 1},
    "set": {1, 2, 3},
    "iterator": iter(()),
    "object": object(),
    "class": vd.Circle,
    "function": lambda *_: None,
    "raises": lambda *_: 1 // 0,
    "path": Path("nowhere.xyz"),
    "array of floats": np.linspace(0, 1, 6).reshape(2, 3),
    "array of texts": np.array(["a", "b"]),
    "array of objects": np.array([None, object()]),
    "masked array": np.ma.masked_array(np.ones((2, 3), dtype=int), mask=[[0, 1, 0], [0, 0, 0]]),
    "dates": np.zeros((2, 3), dtype="M8[D]"),
    "records": np.zeros(3, dtype=[("a", float)]),
    "empty array": np.empty((0, 3)),
    "number in an array": np.array(3.0),
    "curve": vd.Circle((5, 5, 5), 3),
    "frame": vd.Frame((3, 5, 7)),
}


@cache
def raise_lines(path):
    """Lines of a source file that belong to ``raise`` statements."""
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    return {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Raise)
        for line in range(node.lineno, node.end_lineno + 1)
    }


def assert_raised_on_purpose(error, what):
    """The error comes from a ``raise`` statement of the package, or from the call itself."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    if Path(__file__).parent in Path(frame.filename).parents:
        assert isinstance(error, TypeError), f"{what}: {error!r}"
        assert "argument" in str(error)
        return
    inside = PACKAGE in Path(frame.filename).parents
    assert inside, f"{what}: {type(error).__name__} {error} from {frame.filename}:{frame.lineno}"
    assert frame.lineno in raise_lines(frame.filename), (
        f"{what}: {type(error).__name__} {error} at {frame.filename}:{frame.lineno}: {frame.line}"
    )
    assert isinstance(error, TypeError | ValueError | OSError | vd.VoxDisplayError)
    assert str(error).isprintable() or "\n" in str(error)
