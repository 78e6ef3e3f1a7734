"""``voxdisplay bench``: what it measures, and what it leaves."""

import json

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.cli import bench_measurements
from voxdisplay.cli.main import main


@pytest.fixture
def quick(monkeypatch):
    """Measure as little as can be."""
    for name in ("_BUDGET_S", "_RAW_BUDGET_S", "_NOISE_BUDGET_S"):
        monkeypatch.setattr(bench_measurements, name, 0.01)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("format_", ["rgb888", "rgb565", "index8", "mono1"])
def test_json_has_generation_coding_and_link_beside_the_raw_pipe(capsys, format_):
    assert main(["bench", "--port", f"sim:?size=17x30x11&format={format_}", "--json"]) == 0
    printed = capsys.readouterr()
    result = json.loads(printed.out)
    assert set(result) == {"machine", "generation", "coding", "link"}
    assert [each["scene"] for each in result["generation"]] == ["one curve", "100 curves"]
    for each in (*result["generation"], *result["coding"]):
        assert each["voxels"] > 10
        assert each["voxels_per_s"] == pytest.approx(each["voxels"] / each["seconds"])
    link = result["link"]
    assert link["device"]["format"] == format_
    assert link["bytes_per_s"] == pytest.approx(link["wire_bytes"] / link["seconds"])
    assert link["share_of_raw"] == pytest.approx(link["bytes_per_s"] / link["raw_bytes_per_s"])
    assert printed.err == ""


@pytest.mark.usefixtures("quick")
def test_the_display_is_dark_afterwards(emulator, tmp_path, run):
    running = emulator("--tcp", "127.0.0.1:0", "--size", "17x30x11", "--refresh", "0")
    assert main(["bench", "--port", running.port, "--quiet"]) == 0
    page = tmp_path / "page.npy"
    assert run("read", "--port", running.port, "-o", page).returncode == 0
    assert not np.load(page).any()


@pytest.mark.usefixtures("quick")
def test_the_raw_pipe_damages_nothing():
    """Segments of fewer than 8 bytes are not counted (protocol.md, section 3)."""
    with vd.open("sim:?size=3x5x7") as display:
        transport = display._connection._transport
        info = bench_measurements.request_info(transport, 1.0)
        bench_measurements.measure_raw_pipe(transport, info, 1.0)
        display._connection.restart(1.0)
        assert display.counters.device_damaged == 0


@pytest.mark.parametrize("format_", ["rgb888", "rgb565", "index8", "mono1"])
def test_noise_is_as_long_as_asked(format_):
    with vd.open(f"sim:?size=32x32x32&format={format_}") as display:
        sizes = [
            sum(map(len, bench_measurements.noise_frame(display.info, size, 1).payloads(1024)))
            for size in (512, 2048)
        ]
    assert 512 <= sizes[0] <= 600 + 16
    assert 2048 <= sizes[1] <= 2400


def test_a_port_that_is_not_there(run):
    done = run("bench", "--port", "/dev/ttyNOWHERE")
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
