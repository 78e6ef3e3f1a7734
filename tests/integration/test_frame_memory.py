"""Memory of frames in processes of their own: by what is lit, not by the grid."""

import json
import subprocess
import sys

import pytest

GRID = 1024
LIMIT_MB = 150  # an interpreter with numpy takes some 50
SCENE = {
    "objects": [
        {"type": "torus_knot", "p": p, "q": 7, "center": [512] * 3, "major": 300, "minor": 150}
        for p in (2, 3, 5)
    ]
}


def run(*command):
    """Run a command and return its peak memory in megabytes."""
    code = (
        "import resource, subprocess, sys\n"
        "subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)\n"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, command)], check=True, capture_output=True, text=True
    )
    return int(done.stdout) / 1024


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss is in kilobytes on Linux")
@pytest.mark.parametrize("format_", ["mono1", "rgb888"])
def test_a_push_to_a_large_display_takes_memory_for_what_is_lit(tmp_path, format_):
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(SCENE))
    port = f"sim:?size={GRID}x{GRID}x{GRID}&format={format_}"
    peak_mb = run(sys.executable, "-m", "voxdisplay", "push", scene, "--port", port)
    assert peak_mb < LIMIT_MB, "the grid alone has 1 or 3 GB"


PRESENT = """
import tracemalloc, sys
import numpy as np
import voxdisplay as vd
frame = vd.Frame((1024, 1024, 1024), "rgb888")
kind, rate = sys.argv[1], float(sys.argv[2])
side = 500
y, x = np.mgrid[:side, :side]
z = (300 + 30 * np.sin(x / 40) * np.cos(y / 55)).astype(np.int32)
shell = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1).astype(np.int32)
curve = vd.voxelize(vd.TorusKnot(12, 35, (512, 512, 512), 300, 150))
features = ("line", "box", "dots", "oct")
tracemalloc.start()
if kind == "array":
    frame.draw(shell, "red")
elif kind == "curves":
    for shift in range(8):
        frame.draw(curve.voxels + 4 * shift, "red")
lit = len(frame.lit()[0])
tracemalloc.reset_peak()
other = frame.copy()
other.draw([(1, 2, 3)], "lime")
assert other != frame
assert len(other.difference(frame, 1024, features)) == 1
other.digest()
for _ in other.iter_payloads(1024, features, rate):
    pass
print(lit, tracemalloc.get_traced_memory()[1])
"""


@pytest.mark.parametrize("kind", ["array", "curves"])
@pytest.mark.parametrize("rate", [0, 1e9])
def test_a_frame_takes_at_most_200_bytes_for_each_lit_voxel(kind, rate):
    command = [sys.executable, "-c", PRESENT, kind, str(rate)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    lit, peak = map(int, done.stdout.split())
    assert lit > 100_000
    assert peak <= 200 * lit
