"""The widget around the page, in a real browser and without a notebook."""

import base64
import json
from importlib.resources import files

import browser as browsers
import pytest
from live_page import SIZE, page_of

import voxdisplay as vd
from voxdisplay.view.film import FilmJob
from voxdisplay.view.html_export import page_with
from voxdisplay.view.live.snapshot_message import Snapshot

pytest.importorskip("anywidget", reason="needs the extra notebook")

from voxdisplay.view.notebook.film_view import film_widget
from voxdisplay.view.notebook.live_feed import packed_message
from voxdisplay.view.notebook.live_view import LiveView

pytestmark = browsers.NEEDED

# A stand-in for the notebook: a model with the traits of a widget, in an element that is
# disconnected when the kernel is gone.
NOTEBOOK = """<!doctype html><meta charset="utf-8"><div id="cell"></div><script type="module">
const heard = {}, traits = TRAITS, bytes = text => {
  const all = Uint8Array.from("padding" + atob(text), c => c.charCodeAt(0));
  return new DataView(all.buffer, 7);
};
if (traits.latest) traits.latest = bytes(traits.latest);
window.sent = [];
window.fire = name => heard[name]?.();
window.change = (name, value) => {
  traits[name] = name === "latest" ? bytes(value) : value;
  fire(`change:${name}`);
};
const model = {
  get: name => traits[name],
  on: (names, act) => names.split(" ").forEach(name => heard[name] = act),
  send: message => sent.push(message),
};
const url = URL.createObjectURL(new Blob([CODE], { type: "text/javascript" }));
const { default: widget } = await import(url);
window.end = widget.render({ model, el: document.getElementById("cell") });
</script>"""
INNER = "document.querySelector('iframe')?.contentDocument"
STATE = f"{INNER}.getElementById('state').textContent"


def snapshot(number):
    page = page_of((1, 2, number))
    return Snapshot(page, vd.Grid(*SIZE), vd.PixelFormat.RGB888, number, "a")


def text(snapshot):
    return base64.b64encode(packed_message(snapshot)).decode()


def lit(page):
    """Return how many pixels of the cell's canvas are bright."""
    return page.run(
        f"(c => c.getContext('2d').getImageData(0, 0, c.width, c.height).data"
        f".reduce((n, v, i) => n + (i % 4 < 3 && v > 150), 0))({INNER}.getElementById('canvas'))"
    )


@pytest.fixture
def cell(tab, tmp_path):
    """Open a notebook of one cell with a widget's traits."""

    def open_cell(traits, patience_ms=10000):
        code = files("voxdisplay.view.notebook").joinpath("widget.js").read_text(encoding="utf-8")
        code = code.replace("= 10000;", f"= {patience_ms};")
        safe = {"<": "\\u003c"}
        texts = [json.dumps(each).translate(str.maketrans(safe)) for each in (traits, code)]
        path = tmp_path / "notebook.html"
        path.write_text(
            NOTEBOOK.replace("CODE", texts[1]).replace("TRAITS", texts[0]), encoding="utf-8"
        )
        page = tab(path.as_uri(), width=700, height=500)
        page.wait(f"{INNER}?.getElementById('canvas')?.width > 300")
        return page

    return open_cell


def test_a_frame_turns_in_its_cell(cell):
    film = FilmJob([snapshot(3).page], vd.Grid(*SIZE), vd.PixelFormat.RGB888)
    page = cell({"page": film_widget(film, None, bytes).page, "height": 400})
    for _ in range(100):
        if before := lit(page):
            break
    assert before
    assert page.run(f"getComputedStyle({INNER}.querySelector('aside')).display") == "none"
    assert page.run(f"getComputedStyle({INNER}.getElementById('playback')).display") == "none"
    assert page.run("document.activeElement === document.body"), "the notebook keeps the focus"
    picture = f"{INNER}.getElementById('canvas').toDataURL()"
    first = page.run(picture)
    page.mouse("mousePressed", 300, 200, button="left", clickCount=1)
    page.mouse("mouseMoved", 380, 230, button="left", buttons=1)
    page.mouse("mouseReleased", 380, 230, button="left", clickCount=1)
    page.wait(f"{picture} !== {json.dumps(first)}")


def test_a_live_view_follows_and_says_how_things_are(cell, monkeypatch):
    monkeypatch.setattr(LiveView, "_end", lambda view: view._ended.set())

    class Ended:
        def next(self):
            raise vd.TransportClosed("it is closed")

    view = LiveView(Ended(), snapshot(1))
    page = cell(
        {"page": view.widget.page, "height": 400, "latest": text(snapshot(1)), "state": "live"}
    )
    page.wait(f"{STATE} === 'no kernel: last picture'")  # until there is an answer
    assert page.run("sent.length") == 1
    page.run("fire('msg:custom')")
    page.wait(f"{STATE} === 'live'")
    for number in (2, 3, 4):
        page.run(f"change('latest', {json.dumps(text(snapshot(number)))})")
    page.wait(f"+{INNER}.getElementById('scrub').max === 3")
    page.run("change('state', 'the display is closed')")
    page.wait(f"{STATE} === 'the display is closed'")
    page.run("cell.className = 'jupyter-widgets-disconnected', fire('comm_live_update')")
    page.wait(f"{STATE} === 'no kernel: last picture'")
    assert lit(page), "the last picture stays"
    page.run("end()")


def test_a_live_view_notices_that_its_kernel_has_fallen_silent(cell):
    page = cell(
        {
            "page": page_with({"cell": True}, "a"),
            "height": 400,
            "latest": text(snapshot(1)),
            "state": "live",
        },
        200,
    )
    page.run("window.beating = setInterval(() => fire('msg:custom'), 20)")
    page.wait(f"{STATE} === 'live'")
    page.run("clearInterval(beating)")
    page.wait(f"{STATE} === 'no kernel: last picture'")
    page.run("fire('msg:custom')")
    page.wait(f"{STATE} === 'live'")
