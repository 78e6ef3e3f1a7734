"""Recordings that the page of the live view writes, read by the driver and played by a display."""

from __future__ import annotations

import base64
import json
import subprocess
import sys

import browser as browsers
import numpy as np
import pytest
from recording_document import vectors

import voxdisplay as vd
from voxdisplay.shows.recording import Recording
from voxdisplay.view.html_export import save_html

pytestmark = browsers.NEEDED


SAVED = """
new Promise(done => {
  download = async (blob, name) => {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    let text = "";
    for (const byte of bytes) text += String.fromCharCode(byte);
    done([name, btoa(text)]);
  };
  recordVoxels();
})
"""


def saved(page, path):
    """Press the button that saves; return the recording."""
    name, data = page.run(SAVED)
    assert name == "voxdisplay.vxs"
    path.write_bytes(base64.b64decode(data))
    return Recording(path)


def noise(size, format_, seed, share=0.3):
    chance = np.random.default_rng(seed)
    shape = (*size[::-1], 3) if format_ == "rgb888" else size[::-1]
    top = {"mono1": 2, "index8": 256, "rgb565": 65536, "rgb888": 256}[format_]
    page = chance.integers(0, top, shape).astype(np.uint16 if format_ == "rgb565" else np.uint8)
    dark = chance.random(size[::-1]) > share
    page[dark] = 0
    page[0, 0] = page[-1, -1] = top - 1  # rows, which are runs
    return page


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
@pytest.mark.parametrize("size", [(3, 5, 7), (300, 4, 3)])
def test_a_page_becomes_a_recording_of_the_same_voxels(tab, tmp_path, format_, size):
    pages = [noise(size, format_, seed, share) for seed, share in enumerate((0.3, 0.9, 0.0))]
    palette = None
    if format_ == "index8":
        palette = np.array(vd.Frame(size, "index8").palette)
        palette[[7, 9, 255]] = (1, 2, 3), (4, 5, 6), (7, 8, 9)
    path = tmp_path / "page.html"
    save_html(
        path, pages, vd.Grid(*size), vd.PixelFormat(format_), title="a", fps=12.5, palette=palette
    )
    page = tab(path.as_uri())
    page.wait("painted && history.length === 3")
    found = saved(page, tmp_path / "a.vxs")
    assert found.whole
    assert (found.frame_count, found.fps, found.loop) == (3, 12.5, False)
    assert (found.format.grid, found.format.format.value) == (size, format_)
    assert found.format.meta["name"] == "a"
    assert found.format.features == (("palette",) if palette is not None else ())
    for number, wanted in enumerate(pages):
        frame = found.frame(number)  # its digest is that of the file
        assert np.array_equal(frame.array(), wanted)
        if palette is not None:
            assert np.array_equal(frame.palette, palette)
    with vd.open(f"sim:?size={'x'.join(map(str, size))}&format={format_}&refresh=0") as display:
        report = display.play(found, clock="host", late="delay")
        assert (report.shown, report.wrong) == (3, 0)
        assert np.array_equal(display.read(), pages[2])


def test_packets_are_those_of_the_document(tab, tmp_path):
    path = tmp_path / "page.html"
    save_html(path, [np.zeros((3, 2, 4), np.uint8)], vd.Grid(4, 2, 3), vd.PixelFormat.MONO1)
    page = tab(path.as_uri())
    raws = [bytes.fromhex(each["raw"]) for each in vectors() if "raw" in each]
    (file,) = (bytes.fromhex(each["file"]) for each in vectors() if "file" in each)
    packets = [
        page.run(f"[...packetOf({raw[0] >> 4}, {raw[0] & 15}, {raw[1]}, {raw[2]}, {[*raw[3:-4]]})]")
        for raw in raws
    ]
    assert b"\0" + b"".join(map(bytes, packets)) == file
    for length in (253, 254, 255, 508, 509):  # groups of COBS that are full
        body = [1 + n % 255 for n in range(length)]
        encoded = bytes(page.run(f"[...packetOf(1, 0, 1, 1, {body})]"))
        assert unstuffed(encoded)[3:-4] == bytes(body)


def unstuffed(data):
    assert data[-1] == 0
    out, at = bytearray(), 0
    while at < len(data) - 1:
        code = data[at]
        out += data[at + 1 : at + code]
        at += code
        if code < 255 and at < len(data) - 1:
            out.append(0)
    return bytes(out)


def test_what_a_display_shows_is_taken_until_it_is_stopped(tab, tmp_path):
    command = [sys.executable, "-m", "firmware_sim", "--tcp", "127.0.0.1:0", "--refresh", "0"]
    command += ["--size", "3x5x7", "--view", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            place = json.loads(process.stdout.readline())
            with vd.open(place["port"]) as display:
                frames = []
                for count in range(1, 4):
                    frame = display.frame()
                    frame.draw(np.array([(0, n, n) for n in range(count)]), "orange")
                    frames.append(frame)
                page = tab(place["view"])
                display.present(frames[0])
                page.wait("current()?.n === 1")
                page.key("t")
                assert page.wait("taken.length") == 1
                for count, frame in enumerate(frames[1:], 2):
                    display.present(frame)
                    page.wait(
                        f"current().n === {count} && performance.now() > taken.at(-1)[0] + 50"
                    )
                found = saved(page, tmp_path / "a.vxs")
                assert page.run("taken") is None
        finally:
            process.terminate()
            process.wait(browsers.DEADLINE_S)
    assert found.whole
    assert found.fps == 30
    shown = [found.frame(number).digest() for number in range(found.frame_count)]
    wanted = [frame.digest() for frame in frames]
    assert list(dict.fromkeys(shown)) == wanted
