"""The main job, over a real tty to an emulator in another process."""

import json

import numpy as np
import pytest

PAPER = "examples/paper-curve.json"
ORANGE = {"mono1": 1, "index8": 0b111_100_00, "rgb565": 0xFC40, "rgb888": (0xFF, 0x88, 0x00)}


def drawn(rows, size, format_):
    """Build the page from the rows that ``voxelize`` writes: object, x, y, z."""
    nx, ny, nz = size
    dtype = np.uint16 if format_ == "rgb565" else np.uint8
    page = np.zeros((nz, ny, nx, 3) if format_ == "rgb888" else (nz, ny, nx), dtype=dtype)
    for _, x, y, z in rows.tolist():
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            page[z, y, x] = ORANGE[format_]
    return page


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
@pytest.mark.parametrize("size", [(128, 128, 128), (17, 64, 40)])
def test_the_dump_is_the_sequence(emulator, run, tmp_path, size, format_):
    text = "x".join(map(str, size))
    dump, voxels = tmp_path / "out.npy", tmp_path / "voxels.npy"
    features = "line,box,dots,oct,read,digest"  # a palette of its own would have orange elsewhere
    options = ("--size", text, "--format", format_, "--features", features)
    device = emulator("--pty", "--dump", dump, *options)

    pushed = run("push", PAPER, "--port", device.port, "--fit", "none", "--verify", "--json")
    assert pushed.returncode == 0, pushed.stderr
    result = json.loads(pushed.stdout)
    assert result["verified"] is True
    assert result["device"] == {
        "size": list(size), "format": format_, "protocol": "1.0", "firmware": "1.0",
    }  # fmt: skip

    assert run("voxelize", PAPER, "-o", voxels).returncode == 0
    page = drawn(np.load(voxels), size, format_)
    assert np.array_equal(np.load(dump), page)
    assert result["voxels"] == np.count_nonzero(page.any(axis=-1) if page.ndim == 4 else page)

    clipped = run("voxelize", PAPER, "--clip", text, "-o", voxels, "--json")
    assert json.loads(clipped.stdout)["voxels"] == result["voxels"]


def test_the_paper_curve_is_one_small_packet(emulator, run):
    device = emulator("--pty")
    result = json.loads(run("push", PAPER, "--port", device.port, "--json").stdout)
    assert result["packets"] == 1
    hello, overhead = 15, 9
    assert result["wire_bytes"] <= hello + 230 + overhead
    assert result["retransmitted"] == 0


def test_read_gives_the_front_page(emulator, run, tmp_path):
    dump, read = tmp_path / "out.npy", tmp_path / "read.npy"
    device = emulator("--pty", "--dump", dump, "--size", "31x20x9", "--format", "rgb565")
    assert run("push", "examples/trefoil.json", "--port", device.port).returncode == 0
    assert run("read", "--port", device.port, "-o", read).returncode == 0
    assert np.array_equal(np.load(read), np.load(dump))
    assert np.load(read).any()
    assert run("clear", "--port", device.port).returncode == 0
    assert not np.load(dump).any()


def test_tcp(emulator, run):
    device = emulator("--tcp", "127.0.0.1:0", "--size", "17x64x40")
    for port in (device.port, device.port.replace("tcp:", "socket:")):
        pushed = run("push", PAPER, "--port", port, "--verify", "--json")
        assert pushed.returncode == 0, pushed.stderr
        assert json.loads(pushed.stdout)["verified"] is True


def test_a_noisy_line_changes_nothing_but_the_count(emulator, run, tmp_path):
    dump = tmp_path / "out.npy"
    device = emulator("--pty", "--dump", dump, "--size", "40x40x40", "--fault", "flip=2e-4")
    for name in ("trefoil", "double-helix", "lissajous"):
        pushed = run("push", f"examples/{name}.json", "--port", device.port, "--verify", "--json")
        assert pushed.returncode == 0, pushed.stderr
        result = json.loads(pushed.stdout)
        lit = np.load(dump).any(axis=-1)
        assert np.count_nonzero(lit) == result["voxels"]
