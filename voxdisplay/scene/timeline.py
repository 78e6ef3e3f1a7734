"""Timeline of a moving scene: its frames, their times, and the params that depend on the time.

Must not know objects, nor what the params are for.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.errors import CurveError, SceneError
from voxdisplay.expressions.params import param_order
from voxdisplay.expressions.parse import TIME, constant, parse
from voxdisplay.scene.evaluation_context import as_scene_error
from voxdisplay.scene.values import Track

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from voxdisplay.compute.array_types import Floats
    from voxdisplay.expressions.program import Expression

DURATION = "duration"
"""Name of the duration in expressions."""
MAX_FRAMES = 10_000_000
"""Most frames of a scene: 92 hours at 30 frames a second."""
MAX_FPS = 10_000.0
BLOCK_FRAMES = 64
"""Frames whose numbers are computed together."""


@dataclass(frozen=True, slots=True)
class _Keys:
    """A track with its expressions parsed."""

    at: Floats  # (k,), ascending
    values: tuple[Expression, ...]
    ease: str

    def value(self, times: Floats, variables: Sequence[Floats]) -> Floats:
        """Return the values, (n,), at times, (n,)."""
        after = np.searchsorted(self.at, times, side="right")
        before, after = np.maximum(after - 1, 0), np.minimum(after, len(self.at) - 1)
        values = np.stack(
            [np.broadcast_to(each.value(*variables), times.shape) for each in self.values]
        )
        here = np.arange(times.size)
        if self.ease == "step":
            return np.asarray(values[before, here])
        span = self.at[after] - self.at[before]
        share = np.clip((times - self.at[before]) / np.where(span > 0, span, 1.0), 0.0, 1.0)
        if self.ease == "smooth":
            share = share * share * (3 - 2 * share)
        return np.asarray(values[before, here] * (1 - share) + values[after, here] * share)


class Timeline:
    """Frames of a moving scene and what its params are at their times.

    Parameters
    ----------
    duration : str or float
        Seconds.
    fps : str or float
        Frames per second.
    loop : bool
    params : mapping of str to str, float or Track

    Raises
    ------
    SceneError
        If a number, a name or a track is wrong, or there are too many frames.

    Attributes
    ----------
    duration, fps : float
    loop : bool
        Whether the scene is meant to start again at its end.
    frame_count : int
        Frame n is that of the time n / fps; the last is one before the duration.
    constants : dict of str to float
        The duration, and the params that do not depend on the time.
    variables : tuple of str
        ``"time"``, and the params that depend on it.

    """

    def __init__(
        self,
        duration: str | float,
        fps: str | float,
        *,
        loop: bool,
        params: Mapping[str, str | float | Track],
    ) -> None:
        self.duration, self.fps = _positive("duration", duration), _positive("fps", fps)
        if self.fps > MAX_FPS:
            raise SceneError(f"{self.fps:g} is more than {MAX_FPS:g}", path="$.fps")
        frames = self.duration * self.fps
        what = f"{self.duration:g} s at {self.fps:g} frames a second are"
        if not frames <= MAX_FRAMES:
            problem = f"{what} {frames:.3g} frames, more than {MAX_FRAMES}"
            raise SceneError(problem, path="$.duration")
        self.frame_count = round(frames)
        if not self.frame_count:
            raise SceneError(f"{what} less than one frame", path="$.duration")
        self.loop = loop
        self.constants = {DURATION: self.duration}
        self.variables: tuple[str, ...] = (TIME,)
        self._varying: list[Expression | _Keys] = []
        self._read_params(params)

    def _read_params(self, params: Mapping[str, str | float | Track]) -> None:
        for name in (TIME, DURATION):
            if name in params:
                problem = f"a param of a moving scene cannot be called {name!r}"
                hint = "it has a meaning there: the scene has a duration"
                raise SceneError(problem, path=f"$.params.{name}", hint=hint)
        with as_scene_error("$.params"):
            order = param_order({name: _texts(source) for name, source in params.items()})
        for name in order:
            source, path = params[name], f"$.params.{name}"
            with as_scene_error(path):
                found: Expression | _Keys
                if isinstance(source, Track):
                    found = self._keys(source, path)
                else:
                    found = parse(source, self.constants, variables=self.variables)
                    if found.constant is not None:
                        self.constants[name] = found.constant
                        continue
            self._varying.append(found)
            self.variables += (name,)

    def _keys(self, track: Track, path: str) -> _Keys:
        at: list[float] = []
        values: list[Expression] = []
        for i, (when, value) in enumerate(track.keys):
            with as_scene_error(f"{path}.keys[{i}][0]"):
                at.append(constant(when, self.constants))
                if i and at[i] < at[i - 1]:
                    raise CurveError(
                        f"the key at {at[i]:g} s stands behind that at {at[i - 1]:g} s",
                        hint="write keys in the order of their times",
                    )
            with as_scene_error(f"{path}.keys[{i}][1]"):
                values.append(parse(value, self.constants, variables=self.variables))
        return _Keys(np.array(at), tuple(values), track.ease)

    def values_at(self, times: Floats) -> list[Floats]:
        """Return the values of `variables`, (n,) each, at times in seconds, (n,)."""
        values = [times]
        for found in self._varying:
            if isinstance(found, _Keys):
                values.append(found.value(times, _passed(found.values[0], values)))
            else:
                part = found.value(*_passed(found, values))
                values.append(np.broadcast_to(part, times.shape))
        return values

    def time_of(self, frame: int) -> float:
        """Return the time of a frame in seconds: computed from its number, never summed."""
        return frame / self.fps

    def block_of(self, time: float) -> tuple[Floats, int]:
        """Return the times that are computed with a time, (n,), and which of them it is.

        A frame's block depends on its number alone, so that its values do, to the last bit.
        """
        frame = round(time * self.fps)
        if self.time_of(frame) != time:
            return np.full(BLOCK_FRAMES, time), 0
        first = frame // BLOCK_FRAMES * BLOCK_FRAMES
        return (first + np.arange(BLOCK_FRAMES)) / self.fps, frame - first


def _passed(expression: Expression, values: list[Floats]) -> list[Floats]:
    """Return those of the values that an expression knows: later ones came after it."""
    return values[: len(expression.variables)]


def _positive(key: str, source: str | float) -> float:
    with as_scene_error(f"$.{key}"):
        value = constant(source)
        if value <= 0:
            raise CurveError(f"must be more than 0, not {value:g}")
    return value


def _texts(source: str | float | Track) -> list[str | float]:
    """Return the expressions on which the value of a param depends."""
    return list(chain.from_iterable(source.keys)) if isinstance(source, Track) else [source]
