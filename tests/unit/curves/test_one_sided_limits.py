"""Numerical one-sided limits: limits, poles, oscillations, rounding."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from voxdisplay.curves.one_sided_limits import limit

H = 0.3 * 0.5 ** np.arange(48)

Function = Callable[[np.ndarray], np.ndarray]


def at(function: Function) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.asarray(function(H), dtype=float)


@pytest.mark.parametrize(
    ("function", "value"),
    [
        (lambda h: 7 + 0 * h, 7),
        (lambda h: 7 - 3 * h, 7),
        (lambda h: 60 * np.sin(h) / h, 60),
        (np.sqrt, 0),
        (lambda h: 5 + 3 * h**0.1, 5),
        (lambda h: h * np.log(h), 0),
        (lambda h: 20 * h * np.sin(1 / h), 0),
        # Rounding leaves nothing of the next three where h is small.
        (lambda h: 60 * (1 - np.cos(h)) / h**2, 30),
        (lambda h: 60 * (h - np.sin(h)) / h**3, 10),
        (lambda h: ((np.sqrt(2) + h) ** 2 - 2) / h, 2 * np.sqrt(2)),
    ],
)
def test_limits_are_found(function: Function, value: float) -> None:
    assert limit(at(function)).value == pytest.approx(value, abs=2e-4)


@pytest.mark.parametrize(
    "function",
    [
        lambda h: 1 / h,
        lambda h: -1e-3 / h**2,
        lambda h: 5 + 1e-7 / h,
        lambda h: 30 * np.sin(h) / h + 1e-7 / h,
        lambda h: 1 / np.sqrt(h),
        lambda h: np.exp(1 / h),
    ],
)
def test_poles_diverge(function: Function) -> None:
    outcome = limit(at(function))
    assert np.isnan(outcome.value)
    assert outcome.diverges


@pytest.mark.parametrize(
    "function",
    [
        np.log,
        lambda h: np.sin(1 / h),
        lambda h: np.where(np.arange(h.size) % 2, 1.0, -1.0),
        lambda h: h + np.nan,
    ],
)
def test_what_neither_settles_nor_has_values_has_no_limit(function: Function) -> None:
    assert np.isnan(limit(at(function)).value)


def test_values_that_rounding_spoiled_are_told() -> None:
    spoiled = limit(at(lambda h: 60 * (1 - np.cos(h)) / h**2))
    clean = limit(at(lambda h: 60 * np.sin(h) / h))
    assert clean.settled == H.size - 1
    assert H[spoiled.settled] > 1e-8


@pytest.mark.parametrize("size", [0, 1, 5])
def test_few_values_have_no_limit(size: int) -> None:
    assert np.isnan(limit(np.ones(size)).value)
