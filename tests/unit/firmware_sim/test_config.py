"""Configuration of the emulated device, and the .npy export."""

import copy
import io
import pickle
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from device_packets import DeviceUnderTest, data

from firmware_sim.bench import Bench, Snapshot
from firmware_sim.config import (
    FEATURES,
    Config,
    parse_names,
    parse_number,
    parse_refresh,
    parse_size,
)
from firmware_sim.faults import parse_faults
from firmware_sim.memory import FORMATS
from firmware_sim.npy import npy_header, write_npy
from firmware_sim.sparse_pixels import SparsePixels


def test_defaults() -> None:
    config = Config()
    assert str(config.shape) == "128x128x128"
    assert (config.pixel_format, config.max_payload, config.boot) == ("rgb888", 1024, None)
    assert (config.refresh, config.rx_buffer, config.max_silent_acks) == (30_000, 16_384, 0)
    assert config.feature_bits == 0b11_1111_1010_1111
    assert (config.minor, Config(features=frozenset({"box"})).minor) == (1, 0)


def test_the_features_are_those_that_the_format_allows() -> None:
    """MUST NOT announce a reserved feature, nor one that its format does not allow."""
    assert Config(pixel_format="index8").feature_bits == 0b11_1111_1111_1111
    assert Config(pixel_format="mono1").feature_bits == 0b1_1011_1010_1111
    assert Config(pixel_format="index8", refresh=0).feature_bits == 0b10_1111_1111_1111
    assert Config(features=frozenset()).feature_bits == 0
    for name, bit in FEATURES.items():
        config = Config(pixel_format="index8", features=frozenset({name}))
        assert config.feature_bits == 1 << bit


@pytest.mark.parametrize(
    ("settings", "remedy"),
    [
        ({"grid": (0, 1, 1)}, "from 1 to 65535"),
        ({"grid": (1, 1, 65_536)}, "from 1 to 65535"),
        ({"grid": (65_535, 32_769, 1)}, "2147483647 voxels or less"),
        ({"pixel_format": "rgb"}, "take one of mono1, index8, rgb565, rgb888"),
        (
            {"features": frozenset({"palette"})},
            "'palette': take of line, .* with the format rgb888",
        ),
        ({"features": frozenset({"diff"}), "pixel_format": "mono1"}, "with the format mono1"),
        (
            {"features": frozenset({"ark", "box"}), "pixel_format": "index8"},
            "feature 'ark': take of",
        ),
        (
            {"features": frozenset({"hold"}), "refresh": 0},
            "feature 'hold': .* with the format rgb888 and no refresh ticks",
        ),
        ({"lies": frozenset({"size"})}, "lie 'size': take of grid, credit, format"),
        ({"refresh": -1}, "refresh is -1"),
        ({"refresh": 1 << 32}, "to 4294967295"),
        ({"max_payload": 63}, "from 64 to 65535"),
        ({"max_payload": 65_536}, "from 64 to 65535"),
        ({"rx_buffer": 1100}, "from 1101 to"),
        ({"boot": 65_536}, "from 0 to 65535"),
        ({"max_silent_acks": 9}, "from 0 to 8"),
        ({"name": "é" * 128}, "bytes of the name is 256"),
        ({"name": "n" * 64, "max_payload": 64}, "max_payload of 99"),
    ],
)
def test_what_is_no_device_is_refused_with_the_remedy(
    settings: dict[str, object], remedy: str
) -> None:
    """`rx_buffer` MUST be large enough for 64 bytes and the longest packet on the wire."""
    with pytest.raises(ValueError, match=remedy):
        Config(**settings)


def test_the_smallest_and_the_largest_device() -> None:
    Config(rx_buffer=1101)
    Config((1, 1, 1), max_payload=64, rx_buffer=137, name="", boot=0)
    Config(max_payload=65_535, rx_buffer=65_866, name="n" * 255)


def test_values_are_read() -> None:
    assert parse_size("3x5X70") == (3, 5, 70)
    assert parse_size("3,5,70") == (3, 5, 70)
    assert parse_refresh("29.97") == 29_970
    assert parse_refresh("0") == 0
    assert parse_number("0x10") == 16
    assert parse_names("") == frozenset()
    assert parse_names("READ,digest") == {"read", "digest"}


@pytest.mark.parametrize(
    ("parse", "text"),
    [
        (parse_size, "3x5"),
        (parse_size, "axbxc"),
        (parse_size, "-1x2x3"),
        (parse_refresh, "fast"),
        (parse_refresh, "nan"),
        (parse_refresh, "inf"),
        (parse_number, "12.5"),
        (parse_number, ""),
    ],
)
def test_what_cannot_be_read_is_a_value_error(parse: Callable[[str], object], text: str) -> None:
    with pytest.raises(ValueError, match="write"):
        parse(text)


# The picture file


@pytest.mark.parametrize(
    ("name", "dtype", "channels"),
    [("mono1", "u1", ()), ("index8", "u1", ()), ("rgb565", "<u2", ()), ("rgb888", "u1", (3,))],
)
def test_numpy_reads_a_dump(
    tmp_path: Path, name: str, dtype: str, channels: tuple[int, ...]
) -> None:
    rig = DeviceUnderTest(3, 5, 7, pixel_format=name)
    size = FORMATS[name].size
    pixel = b"\x01" if name == "mono1" else b"\x11\x22\x33"[:size]
    rig.show_frame(0, 0, b"\x02\x02\x03\x04\x01" + pixel + b"\xa0")
    path = tmp_path / "front.npy"
    path.write_bytes(b"older")
    write_npy(path, Bench(rig.device).snapshot())
    voxels = np.load(path)
    assert voxels.shape == (7, 5, 3, *channels)
    assert voxels.dtype == np.dtype(dtype)
    lit = voxels[4, 3, 2]
    assert lit.tobytes() == pixel
    assert np.count_nonzero(voxels) == np.count_nonzero(lit)
    assert list(tmp_path.iterdir()) == [path]


def test_the_header_is_aligned() -> None:
    for side in (1, 10, 100, 1000, 10_000):
        header = npy_header(Snapshot(SparsePixels(side, 1), (side, 1, 1), "index8", None, 0, 0, 0))
        assert len(header) % 64 == 0
        assert header.endswith(b"\n")
        assert np.lib.format.read_magic(io.BytesIO(header)) == (1, 0)


def test_what_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    snapshot = Bench(DeviceUnderTest().device).snapshot()
    with pytest.raises(OSError, match="none"):
        write_npy(tmp_path / "none" / "front.npy", snapshot)
    (tmp_path / "dir").mkdir()
    with pytest.raises(OSError, match="dir"):
        write_npy(tmp_path / "dir", snapshot)
    assert [path.name for path in tmp_path.iterdir()] == ["dir"]


def test_on_swap_is_called_at_each_swap() -> None:
    rig = DeviceUnderTest()
    seen = []
    rig.device.on_swap = lambda: seen.append(rig.front[:1])
    rig.show_frame(0, 0, b"\xa0")
    rig.request(data(1, 1, b""))
    rig.show_frame(2, 1, b"")
    assert seen == [b"\xff", b"\0"]


def test_values_of_other_types_are_taken_or_refused_by_name() -> None:
    expected = Config((3, 5, 7), features=frozenset({"line", "read"}))
    assert Config(np.array([3, 5, 7]), features=["line", "read"]) == expected
    assert Config("3x5x7", features="line,read") == expected
    assert Config("3,5,7", lies="boot").lies == frozenset({"boot"})
    for settings, message in (
        ({"grid": 7}, "grid is 7: take three numbers"),
        ({"grid": (1, 2)}, "take three numbers"),
        ({"grid": (1.5, 2, 3)}, "take three numbers"),
        ({"grid": None}, "take three numbers"),
        ({"refresh": "30"}, "refresh is '30': take a whole number"),
        ({"rx_buffer": 1e6}, "rx_buffer is 1000000.0: take a whole number"),
        ({"boot": "7"}, "boot is '7': take a whole number"),
    ):
        with pytest.raises(TypeError, match=re.escape(message)):
            Config(**settings)


@pytest.mark.parametrize("protocol", [2, pickle.HIGHEST_PROTOCOL])
def test_values_can_be_pickled_and_copied(protocol: int) -> None:
    device = DeviceUnderTest(3, 5, 7)
    bench = Bench(device.device)
    for value in (
        *(Config((3, 5, 7), "mono1", lies="boot"), bench.snapshot(), bench.counters()),
        *(*parse_faults("flip=1e-3,reboot@9"), FORMATS["rgb565"], Config().shape),
    ):
        assert pickle.loads(pickle.dumps(value, protocol)) == value  # noqa: S301 - our own
        assert copy.deepcopy(value) == value
