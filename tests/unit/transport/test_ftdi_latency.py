"""Latency timer of a USB-serial chip, in a tree like that of sysfs."""

import pytest

from voxdisplay.transport.ftdi_latency import lower_latency


@pytest.fixture
def timer(tmp_path):
    folder = tmp_path / "bus" / "usb-serial" / "devices" / "ttyUSB3"
    folder.mkdir(parents=True)
    (folder / "latency_timer").write_text("16\n")
    return folder / "latency_timer"


def test_it_is_lowered(timer, tmp_path):
    assert lower_latency("/dev/ttyUSB3", sysfs=tmp_path)
    assert timer.read_text() == "1\n"


def test_a_link_to_the_device_will_do(timer, tmp_path):
    (tmp_path / "ttyUSB3").touch()
    (tmp_path / "by-id").symlink_to(tmp_path / "ttyUSB3")
    assert lower_latency(str(tmp_path / "by-id"), sysfs=tmp_path)
    assert timer.read_text() == "1\n"


def test_what_is_low_is_not_written(timer, tmp_path):
    timer.write_text("0\n")
    assert lower_latency("/dev/ttyUSB3", sysfs=tmp_path)
    assert timer.read_text() == "0\n"


@pytest.mark.parametrize("device", ["/dev/ttyUSB4", "COM3", "", "/dev/\0"])
def test_a_port_without_one_is_left_alone(timer, tmp_path, device):
    assert not lower_latency(device, sysfs=tmp_path)
    assert timer.read_text() == "16\n"


def test_what_is_no_number_is_left_alone(timer, tmp_path):
    timer.write_text("fast\n")
    assert not lower_latency("/dev/ttyUSB3", sysfs=tmp_path)
    assert timer.read_text() == "fast\n"


def test_one_that_cannot_be_written_is_left_alone(timer, tmp_path):
    timer.unlink()
    timer.mkdir()
    assert not lower_latency("/dev/ttyUSB3", sysfs=tmp_path)
