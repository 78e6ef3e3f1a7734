"""Results of the commands on stdout, and notes on stderr."""

import csv
import io
import json
import subprocess
import sys

import document
import numpy as np
import pytest
from conftest import ROOT

from voxdisplay.cli.main import cli

PUSH_KEYS = {
    "port", "device", "frame", "voxels", "packets", "wire_bytes", "retransmitted", "elapsed_s",
    "digest", "repaired", "verified",
}  # fmt: skip
OBJECT_KEYS = {
    "object", "type", "voxels", "closed", "pieces", "e_max", "e_av", "gaps", "contacts", "clipped",
    "seconds", "certified", "undefined", "jumps", "kind",
}  # fmt: skip
PAPER = "examples/paper-curve.json"


def test_push_without_a_port_notes_that_it_uses_the_emulator(run):
    pushed = run("push", PAPER, "--verify")
    assert pushed.returncode == 0
    assert "built-in emulator" in pushed.stderr
    assert "proved" in pushed.stdout
    assert "verified" in pushed.stdout


def test_push_json_is_one_object_with_stable_keys(run):
    pushed = run("push", PAPER, "--port", "sim:", "--json")
    result = json.loads(pushed.stdout)
    assert set(result) == PUSH_KEYS
    assert result["device"]["size"] == [128, 128, 128]
    assert result["verified"] is None, "nothing was read back"
    assert result["repaired"] is None
    assert len(result["digest"]) == 8


def test_the_port_may_come_from_the_environment(run):
    pushed = run("info", "--json", VOXDISPLAY_PORT="sim:?size=3x5x7&format=index8")
    facts = json.loads(pushed.stdout)
    assert facts["size"] == [3, 5, 7]
    assert facts["format"] == "index8"
    assert {"read", "digest", "palette"} <= set(facts["features"])
    assert pushed.stderr == ""


def test_info_for_people(run):
    printed = run("info", "--port", "sim:?size=3x5x7").stdout
    assert "3x5x7" in printed
    assert "read, digest" in printed


def test_a_scene_from_stdin(run):
    scene = {"type": "segment", "from": [0, 0, 0], "to": [2.5, 4.5, 6.5]}
    pushed = run("push", "-", "--port", "sim:?size=3x5x7", "--json", stdin=json.dumps(scene))
    assert pushed.returncode == 0, pushed.stderr
    assert json.loads(pushed.stdout)["voxels"] == 7


def test_another_size_is_fitted_and_noted(run):
    pushed = run("push", PAPER, "--port", "sim:?size=17x64x40")
    assert "scaled by" in pushed.stderr
    kept = run("push", PAPER, "--port", "sim:?size=17x64x40", "--fit", "none")
    assert "scaled" not in kept.stderr
    assert "outside the display" in kept.stderr


def test_a_poorer_display_takes_the_nearest_colour_and_notes_it_once(run):
    pushed = run("push", "examples/lissajous.json", "--port", "sim:?format=mono1")
    assert pushed.stderr.count("nearest") == 1


def test_a_curve_outside_is_a_warning_and_an_empty_picture(run, scene):
    path = scene({"type": "segment", "from": [-9, -9, -9], "to": [-2, -2, -2]})
    pushed = run("push", path, "--port", "sim:?size=3x5x7", "--json")
    assert pushed.returncode == 0
    assert "warning" in pushed.stderr
    assert json.loads(pushed.stdout)["voxels"] == 0


def test_an_empty_scene_is_an_empty_picture(run, scene):
    pushed = run("push", scene({"objects": []}), "--port", "sim:?size=3x5x7", "--verify")
    assert pushed.returncode == 0, pushed.stderr
    assert "0 voxels shown" in pushed.stdout


def test_voxelize_prints_csv(run, scene):
    path = scene(
        {
            "objects": [
                {"type": "segment", "from": [0.5, 0.5, 0.5], "to": [2.5, 0.5, 0.5]},
                {"type": "segment", "from": [-0.5, 4.5, 6.5], "to": [1.5, 4.5, 6.5]},
            ]
        }
    )
    rows = list(csv.reader(io.StringIO(run("voxelize", path).stdout)))
    assert rows[0] == ["object", "x", "y", "z"]
    assert rows[1:4] == [["0", "0", "0", "0"], ["0", "1", "0", "0"], ["0", "2", "0", "0"]]
    assert rows[4] == ["1", "-1", "4", "6"], "not clipped"
    clipped = run("voxelize", path, "--clip", "2,5,7").stdout.splitlines()
    assert clipped == ["object,x,y,z", "0,0,0,0", "0,1,0,0", "1,0,4,6", "1,1,4,6"]


def test_voxelize_by_the_papers_march(run, scene):
    """The paper's Table IV, 2 Mvox: 660, 644 and 651 voxels. Its centres are whole numbers."""
    paper = json.loads((ROOT / PAPER).read_text())
    paper["params"]["o"] += 0.5
    for variant, count in ((1, 660), (2, 644), (3, 651)):
        done = run("voxelize", scene(paper), "--method", "march", "--variant", variant, "--json")
        assert json.loads(done.stdout)["voxels"] == count
    fine = run("voxelize", scene(paper), "--method=march", "--pitch=0.02", "--reach=1", "--json")
    assert json.loads(fine.stdout)["voxels"] == 655


@pytest.mark.parametrize("suffix", [".csv", ".npy", ".json"])
def test_voxelize_writes_files(run, tmp_path, suffix):
    output = tmp_path / f"voxels{suffix}"
    done = run("voxelize", PAPER, "-o", output, "--json")
    report = json.loads(done.stdout)
    assert set(report) == {"objects", "voxels", "seconds"}
    assert [set(entry) for entry in report["objects"]] == [OBJECT_KEYS]
    match suffix:
        case ".csv":
            rows = np.loadtxt(output, delimiter=",", skiprows=1, dtype=int)
        case ".npy":
            rows = np.load(output)
            assert rows.dtype == np.int32
        case ".json":
            rows = np.array(json.loads(output.read_text())["voxels"])
    assert rows.shape == (report["voxels"], 4)
    assert np.abs(np.diff(rows[:, 1:], axis=0)).max() == 1, "26-connected"


def test_ports_lists_the_emulator(run):
    assert "sim:" in run("ports").stdout
    assert json.loads(run("ports", "--json").stdout)["ports"][0]["port"] == "sim:"


def test_clear_and_read(run, tmp_path):
    output = tmp_path / "page.npy"
    assert "dark" in run("clear", "--port", "sim:?size=3x5x7").stdout
    done = run("read", "--port", "sim:?size=3x5x7&format=rgb565", "-o", output, "--json")
    assert json.loads(done.stdout)["voxels"] == 0
    assert np.load(output).shape == (7, 5, 3)
    assert np.load(output).dtype == np.uint16


def test_help_has_examples_and_the_exit_codes(run):
    assert "examples/paper-curve.json" in run("push", "--help").stdout
    assert "130 interrupted" in run("--help").stdout
    assert run("--version").stdout.startswith("voxdisplay, version")


def test_shell_completion(run):
    script = run(_VOXDISPLAY_COMPLETE="bash_source")
    assert "complete" in script.stdout


def test_a_full_disk_is_an_error():
    command = f"{sys.executable} -m voxdisplay voxelize {PAPER} > /dev/full"
    done = subprocess.run(["/bin/bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "No space left" in done.stderr
    assert "fault" not in done.stderr


def test_a_reader_that_has_enough_is_no_error():
    command = f"{sys.executable} -m voxdisplay voxelize {PAPER} | head -n 1"
    bash = ["/bin/bash", "-o", "pipefail", "-c", command]
    piped = subprocess.run(bash, capture_output=True, text=True, check=False)
    assert piped.stdout == "object,x,y,z\n"
    assert piped.stderr == ""
    assert piped.returncode == 0


def test_a_capture_has_every_byte_of_both_directions(run, tmp_path):
    file = tmp_path / "capture.jsonl"
    pushed = run("push", PAPER, "--port", "sim:", "--json", "--capture", file)
    head, *portions = map(json.loads, file.read_text().splitlines())
    assert head == {"voxdisplay_capture": 1, "port": "sim:"}
    assert [portion["s"] for portion in portions] == sorted(portion["s"] for portion in portions)
    sent = b"".join(bytes.fromhex(p["hex"]) for p in portions if p["to"] == "device")
    heard = b"".join(bytes.fromhex(p["hex"]) for p in portions if p["to"] == "host")
    kinds = [body[0] >> 4 for body in document.off_wire(sent.lstrip(b"\0"))]
    assert kinds == [3, 1]
    assert document.off_wire(heard.lstrip(b"\0"))[0][0] == 0x90
    assert len(sent) >= json.loads(pushed.stdout)["wire_bytes"]


def test_a_capture_that_cannot_be_written_is_an_error_before_anything_is_sent(run, tmp_path):
    pushed = run("push", PAPER, "--port", "sim:", "--capture", tmp_path / "no" / "capture.jsonl")
    assert pushed.returncode == 2
    assert "No such file" in pushed.stderr


def test_an_option_of_a_port_means_the_same_everywhere():
    texts = {"baud": set(), "timeout_s": set()}
    for name in ("push", "info", "view", "ports", "plan", "conformance"):
        for option in cli.get_command(None, name).params:
            if option.name in texts:
                text = option.help.split("  [default")[0]
                texts[option.name].add((text, type(option.type), option.metavar))
    assert [len(words) for words in texts.values()] == [1, 1]
