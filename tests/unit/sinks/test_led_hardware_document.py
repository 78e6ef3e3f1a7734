"""docs/led-hardware.md: its tables are those of the code, its command and its profile work."""

import re
import shlex
import tomllib
from dataclasses import MISSING, fields
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from light_receivers import UdpReceiver

from voxdisplay.cli.main import main
from voxdisplay.display.profile import read_profile
from voxdisplay.sinks import artnet, ddp, opc, sacn, wled
from voxdisplay.sinks.settings import _READERS, LAYOUT_KEYS, SinkSettings

ROOT = Path(__file__).parents[3]
DOCUMENT = ROOT / "docs" / "led-hardware.md"
if not DOCUMENT.exists():
    pytest.skip("docs are not installed", allow_module_level=True)
TEXT = DOCUMENT.read_text(encoding="utf-8")
DEFAULTS = {
    field.name: field.default for field in fields(SinkSettings) if field.default is not MISSING
}


def rows(heading):
    """Cells of the rows of the table with a heading."""
    lines = TEXT.split(heading)[1].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_its_ports_are_those_of_the_entry_points():
    ports = [row[0].strip("`") for row in rows("| port | protocol |")]
    kinds = [port.partition(":")[0] for port in ports]
    assert sorted(kinds) == sorted(entry_points(group="voxdisplay.sink").names)
    modules = {"artnet": artnet, "sacn": sacn, "ddp": ddp, "opc": opc, "wled": wled}
    told = {port.partition(":")[0]: int(number) for port in ports
            for number in re.findall(r"\[:(\d+)\]", port)}  # fmt: skip
    assert told == {kind: module.PORT for kind, module in modules.items()}


def test_its_keys_and_defaults_are_those_of_the_settings():
    table = {row[0].strip("`"): row[-1].strip("`") for row in rows("| key | values | default |")}
    assert list(table) == list(LAYOUT_KEYS) + [key for key in table if key not in LAYOUT_KEYS]
    assert set(table) == set(_READERS)
    for key, told in table.items():
        default = DEFAULTS.get(key)
        if key in {"size", "universe", "pixels"}:  # told in words, or by protocol
            continue
        read = _READERS[key](key, told)
        assert read == default, key


def test_its_profile_is_one():
    (text,) = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    profile = read_profile(tomllib.loads(text))
    settings = SinkSettings.from_mapping(profile.sink, _READERS)
    assert settings.size == (16, 16, 16)
    assert profile.port.startswith("artnet://")


def test_its_command_sends_a_cube(monkeypatch, capsys):
    (line,) = re.findall(r"```sh\nvoxdisplay (.*)\n```", TEXT)
    cube = UdpReceiver()
    monkeypatch.chdir(ROOT)
    try:
        assert main(shlex.split(line.replace("192.168.1.50", f"127.0.0.1:{cube.number}"))) == 0
        # 4096 LEDs, 170 of them a universe, and an ArtSync.
        assert len(cube.await_count(26)) == 26
    finally:
        cube.close()
    assert "not proved: nothing answers on this port" in capsys.readouterr().out
