"""Options of ports that every command passes on alike."""

import pytest

from voxdisplay.cli import main
from voxdisplay.display import baud
from voxdisplay.errors import OpenError
from voxdisplay.transport import discovery
from voxdisplay.transport.discovery import FoundPort

SCENE = "examples/trefoil.json"
COMMANDS = [
    ["push", SCENE], ["info"], ["clear"], ["read", "-o", "page.npy"], ["test-pattern"],
    ["plan", SCENE], ["conformance"], ["bench"], ["view"],
]  # fmt: skip


@pytest.fixture
def resets(monkeypatch):
    """Return what is passed on each time that a port was to be opened."""
    passed = []

    def open_transport(port, **options):
        passed.append(options.get("reset"))
        raise OpenError(f"{port} does not exist", port=port)

    monkeypatch.setattr(baud, "open_transport", open_transport)
    return passed


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
@pytest.mark.parametrize("flags", [[], ["--no-reset"]])
def test_every_command_leaves_the_modem_lines_alone_on_request(command, flags, resets):
    assert main([*command, "--port", "/dev/ttyS77", *flags]) == 3
    assert resets == [not flags]


@pytest.mark.parametrize("flags", [[], ["--no-reset"]])
def test_so_does_the_probe_of_all_ports(flags, resets, monkeypatch):
    monkeypatch.setattr(discovery, "all_ports", lambda: [FoundPort("/dev/ttyS77", "a port")])
    main(["ports", "--probe", "--timeout", "0.1", *flags])
    assert resets == [not flags]
