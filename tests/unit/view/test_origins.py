"""Origins of pages that may watch: their notation, and the requests that are refused."""

import http.client
import json
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from voxdisplay.view.live.origins import OriginCheck, parse_origin

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("text", "origin"),
    [
        ("https://cube.example.com", "https://cube.example.com"),
        ("HTTPS://Cube.Example.COM/", "https://cube.example.com"),
        ("https://cube.example.com:443", "https://cube.example.com"),
        ("http://cube.example.com:80/", "http://cube.example.com"),
        ("https://cube.example.com:8443", "https://cube.example.com:8443"),
        ("http://192.168.1.5:8080", "http://192.168.1.5:8080"),
        ("http://[::1]:8080", "http://[::1]:8080"),
        ("cube.example.com", "cube.example.com"),
        ("cube.example.com:8443", "cube.example.com:8443"),
        ("https://Würfel.example:8443", "https://xn--wrfel-kva.example:8443"),
        ("*", "*"),
    ],
)
def test_origins(text, origin):
    assert parse_origin(text) == origin


@pytest.mark.parametrize(
    "text",
    [
        "", " ", "https://", "https://cube.example.com/page", "https://cube example", "ftp://x",
        "//x",
        "https://a:b@c", "https://x:port", "https://x:99999", "https://[::1", "?", "https://*/x#",
        "null\x1b[2J /", "*.example.com", "https://*.example.com", "a,b", "ü..example",
    ],
)  # fmt: skip
def test_what_is_no_origin(text):
    with pytest.raises(ValueError, match="write it like https://cube") as refused:
        parse_origin(text)
    assert str(refused.value).isprintable()


def check(*allowed):
    return OriginCheck("127.0.0.1", map(parse_origin, allowed))


def test_without_a_word_only_pages_of_the_server_itself_may_watch():
    origins = check()
    host = "127.0.0.1:8000"
    assert origins.origin_refusal(None, host) is None
    assert origins.origin_refusal("http://127.0.0.1:8000", host) is None
    for origin in ("https://cube.example.com", "http://127.0.0.1:8001", "null", ""):
        refusal = origins.origin_refusal(origin, host)
        assert refusal.endswith(f"--allow-origin {origin}")


@pytest.mark.parametrize("allowed", ["https://cube.example.com", "cube.example.com", "*"])
def test_an_allowed_origin_is_answered_at_either_host(allowed):
    """A proxy passes on the server's Host or the browser's."""
    origins = check(allowed, "http://other.example")
    for host in ("127.0.0.1:8000", "cube.example.com", "cube.example.com:443"):
        assert origins.host_refusal(host) is None
        assert origins.origin_refusal("https://cube.example.com", host) is None


def test_others_are_refused_still():
    origins = check("https://cube.example.com", "tower.example:8443")
    for origin in (
        "http://cube.example.com", "https://cube.example.com:8443", "https://evil.example",
        "https://cube.example.com.evil.example", "https://tower.example", "null",
    ):  # fmt: skip
        assert origins.origin_refusal(origin, "127.0.0.1:8000") is not None, origin
    assert origins.origin_refusal("https://tower.example:8443", "127.0.0.1:8000") is None
    for host in ("evil.example", "cube.example.com.evil.example", ""):
        assert origins.host_refusal(host) is not None, host


def test_a_refusal_is_printable():
    refusal = check().origin_refusal("http://\x1b[2Jevil", "127.0.0.1")
    assert refusal.isprintable()
    assert check().host_refusal("evil\x9b2J").isprintable()


def emulator(*options):
    command = [sys.executable, "-m", "firmware_sim", "--tcp", "127.0.0.1:0", "--size", "8x8x8"]
    return subprocess.Popen(
        [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    )


@pytest.mark.parametrize("allowed", [[], ["https://cube.example.com"], ["https://a.example", "*"]])
def test_the_emulators_view_behind_a_proxy(allowed):
    """As nginx passes a visitor's request on: Host is the server's, Origin the visitor's."""
    options = [word for origin in allowed for word in ("--allow-origin", origin)]
    with emulator("--view", *options) as process:
        try:
            number = urlsplit(json.loads(process.stdout.readline())["view"]).port
            line = http.client.HTTPConnection("127.0.0.1", number, timeout=60)
            headers = {
                "Origin": "https://cube.example.com", "Upgrade": "websocket",
                "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
            }  # fmt: skip
            line.request("GET", "/live", headers=headers)
            answer = line.getresponse()
            assert answer.status == (101 if allowed else 403)
            if not allowed:
                assert b"--allow-origin https://cube.example.com" in answer.read()
            line.close()
        finally:
            process.terminate()
            process.communicate()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--view", "--allow-origin", "https://x/page"], "'https://x/page' is no origin"),
        (["--allow-origin", "https://cube.example.com"], "--allow-origin is for --view"),
    ],
)
def test_options_that_the_emulator_refuses(options, words):
    process = emulator(*options)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert words in errors
