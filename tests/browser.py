"""Driver of a real Chromium by the DevTools protocol.

One browser serves the whole test session; each test gets tabs of its own. What a tab asks for and
what goes wrong in it is kept.
"""

from __future__ import annotations

import base64
import contextlib
import io
import itertools
import json
import os
import shutil
import signal
import subprocess
import time
import urllib.request

import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
PROGRAM = next(filter(None, map(shutil.which, NAMES)), None)
NEEDED = pytest.mark.skipif(
    PROGRAM is None, reason=f"no browser: none of {', '.join(NAMES)} is installed"
)
DEADLINE_S = 60  # for what never comes; nothing is measured by it
FLAGS = [
    "--headless=new",
    "--remote-debugging-port=0",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-sync",
    "--metrics-recording-only",
    "--mute-audio",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    # A tab that is not in front paints all the same: tests open several.
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--disable-background-timer-throttling",
    "--window-size=1000,700",
]


class Browser:
    """A browser that runs.

    Parameters
    ----------
    profile
        An empty folder.
    """

    def __init__(self, profile):
        flags = [*FLAGS, f"--user-data-dir={profile}"]
        if os.geteuid() == 0:
            flags.append("--no-sandbox")
        self._process = subprocess.Popen(
            [PROGRAM, *flags, "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that all of its processes can be ended
        )
        try:
            self._port = self._wait_for_port(profile / "DevToolsActivePort")
        except BaseException:
            self.close()
            raise

    def _wait_for_port(self, path):
        for _ in range(DEADLINE_S * 20):
            if path.exists() and (lines := path.read_text().splitlines()):
                return int(lines[0])
            if self._process.poll() is not None:
                raise RuntimeError(f"{PROGRAM} ended with {self._process.returncode}")
            time.sleep(0.05)
        raise TimeoutError(f"{PROGRAM} did not start")

    def tab(self, url, *, width=1000, height=700, **emulated):
        """Open a tab and wait until its page is loaded."""
        request = urllib.request.Request(
            f"http://127.0.0.1:{self._port}/json/new?about:blank", method="PUT"
        )
        with urllib.request.urlopen(request, timeout=DEADLINE_S) as answer:  # noqa: S310
            target = json.load(answer)
        tab = Tab(target["webSocketDebuggerUrl"])
        tab.size(width, height, **emulated)
        tab.go(url)
        return tab

    def close(self):
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


class Tab:
    """One page in the browser."""

    def __init__(self, address):
        self._open = contextlib.ExitStack()
        self._socket = self._open.enter_context(connect(address, max_size=None, compression=None))
        self._ids = itertools.count(1)
        self.requests = []  # URLs
        self.errors = []  # what went wrong in the page
        self._loaded = False
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = self._receive()
            if message.get("id") == number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]

    def _receive(self):
        message = json.loads(self._socket.recv(DEADLINE_S))
        given = message.get("params", {})
        match message.get("method"):
            case "Network.requestWillBeSent":
                self.requests.append(given["request"]["url"])
            case "Network.webSocketCreated":
                self.requests.append(given["url"])
            case "Runtime.exceptionThrown":
                details = given["exceptionDetails"]
                self.errors.append(details.get("exception", {}).get("description", str(details)))
            case "Runtime.consoleAPICalled" if given["type"] in ("error", "warning"):
                self.errors.append(str(given["args"]))
            case "Log.entryAdded" if given["entry"]["level"] == "error":
                self.errors.append(given["entry"]["text"])
            case "Page.loadEventFired":
                self._loaded = True
        return message

    def size(self, width, height, *, pixel=1, mobile=False, scheme="dark", motion="no-preference"):
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=pixel,
            mobile=mobile,
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=mobile)
        features = {"prefers-color-scheme": scheme, "prefers-reduced-motion": motion}
        listed = [{"name": name, "value": value} for name, value in features.items()]
        self.call("Emulation.setEmulatedMedia", features=listed)

    def go(self, url):
        self._loaded = False
        self.call("Page.navigate", url=url)
        while not self._loaded:
            self._receive()

    def run(self, script):
        """Evaluate a script, and wait for its promise if it returns one."""
        answer = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            raise RuntimeError(str(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def wait(self, condition, *, errors=False):
        """Wait until a condition, written in JavaScript, holds; return its value.

        An error in the page ends it, unless some are expected.
        """
        end_s = time.monotonic() + DEADLINE_S
        while time.monotonic() < end_s:
            if value := self.run(condition):
                return value
            if self.errors and not errors:
                raise RuntimeError(f"waiting for {condition}: {self.errors[0]}")
            time.sleep(0.02)
        raise TimeoutError(f"never: {condition}")

    def key(self, key, *, shift=False, text=None):
        down = {"type": "keyDown", "key": key, "modifiers": 8 * shift}
        if len(key) == 1:
            down["text"] = text or key
        self.call("Input.dispatchKeyEvent", **down)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, modifiers=8 * shift)

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def screenshot(self):
        """Return a PNG screenshot of the page."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def canvas(self):
        """Return the pixels of the canvas: (height, width, 3) uint8."""
        text = self.run("paint(), canvas.toDataURL('image/png')")
        data = base64.b64decode(text.partition(",")[2])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def close(self):
        # The page may be gone before its answer has been sent.
        with self._open, contextlib.suppress(ConnectionClosed):
            self.call("Page.close")
