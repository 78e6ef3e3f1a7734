"""Conformance kit: passes on the emulator, and detects each of the broken devices."""

import copy
import json
import pickle
from dataclasses import replace

import broken_devices
import pytest
from broken_devices.mutant import Device, around
from kit_runs import DEVICES, by_verdict, emulated_port, examined, explain, info_of

from firmware_sim import crc
from firmware_sim.packet_error import PacketError
from firmware_sim.session import Session
from voxdisplay.conformance import CHECKS, ops, packets
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.catalogue import HANDSHAKE, SECTIONS
from voxdisplay.conformance.device_bugs import DEVICE_BUGS
from voxdisplay.conformance.dialogue import Dialogue, NoResponse, NotApplicable, Violation
from voxdisplay.conformance.reference_decoder import Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.conformance.report import as_json, report_lines, violation_lines
from voxdisplay.conformance.run import Verdict, select_checks
from voxdisplay.conformance.saved_page import SavedPage
from voxdisplay.wire import spec

# Some of every section, to see that a fault elsewhere leaves them alone.
BYSTANDERS = (
    "3/resync", "4/data-flags", "5/info-same", "6/given-up", "7/pen", "7.3/lines", "8/one-voxel",
    "9/data-answered", "9.1/duplicate-answered", "10/ranges", "11/session-ends",
)  # fmt: skip


# -- a device that keeps to the document


@pytest.mark.parametrize("name", DEVICES)
def test_the_emulator_holds(name):
    report = examined(emulated_port(**DEVICES[name]))
    assert report.holds, explain(report)
    assert len(report.results) == len(CHECKS)
    assert report.display_state.startswith(
        "dark" if name in {"bare", "digest-only"} else "as it was"
    )


def test_over_a_real_tty(emulator, run):
    other = emulator("--pty", "--size", "3x5x7", "--format", "index8", "--refresh", "200")
    checked = run("conformance", "--port", other.port, "--json")
    outcome = json.loads(checked.stdout)
    assert checked.returncode == 0, outcome
    assert outcome["conforms"] is True
    assert outcome["counts"]["holds"] > 150
    assert "it will be as it was" in checked.stderr


@pytest.mark.parametrize("name", ["index8", "at-once", "wide"])
@pytest.mark.parametrize(
    "line",
    [{"late_s": 0.008}, {"late_s": 0.02}, {"baud": 115200}, {"late_s": 0.02, "baud": 115200}],
    ids="-".join,
)
def test_the_emulator_holds_on_a_slow_line(name, line):
    report = examined(emulated_port(**line, **DEVICES.get(name, {})))
    assert report.holds, explain(report)


@pytest.mark.parametrize("name", ["at-once", "mono", "wide"])
def test_the_picture_is_put_back(name):
    port = emulated_port(**DEVICES[name])
    device = AnnouncedDevice.from_info(info_of(port))
    drawn = ops.literal(device, [1, 0, 1]) + ops.skip(device.voxel_count - 4) + ops.run()
    port.write(packets.encode(packets.data(0, 0, drawn, packets.CLEAR | packets.COMMIT)), 1)
    while not port.bench.snapshot().pixels.strip(b"\0"):
        port.read(device.period_s)
    before = port.bench.snapshot().pixels
    report = examined(port, ["7/pen", "6/clear"])
    assert report.holds, explain(report)
    assert report.display_state == "as it was"
    assert port.bench.snapshot().pixels == before


# -- devices that do not


@pytest.mark.parametrize("fault", broken_devices.MUTANTS, ids=str)
def test_a_fault_is_found_where_it_is(fault, monkeypatch):
    fault.make(monkeypatch)
    bystanders = [] if fault.spreads else BYSTANDERS
    report = examined(emulated_port(**fault.config), [*fault.fails, *bystanders])
    broken = by_verdict(report, Verdict.BROKEN)
    assert broken == set(fault.fails), explain(report)
    causes = " ".join(result.likely_cause for result in report.results)
    assert fault.likely in causes, causes


@pytest.mark.slow
@pytest.mark.parametrize("fault", broken_devices.MUTANTS, ids=str)
def test_a_fault_is_found_nowhere_else(fault, monkeypatch):
    fault.make(monkeypatch)
    report = examined(emulated_port(**fault.config))
    broken = by_verdict(report, Verdict.BROKEN)
    random_ones = {"7/random-ops", "11/random-ops", "12/mutated", "12/noise"}
    assert set(fault.fails) <= broken
    assert fault.spreads or broken - random_ones <= set(fault.fails), explain(report)


def test_a_device_that_fails_by_silence_costs_less_than_a_minute(monkeypatch):
    monkeypatch.setattr(Device, "_status", lambda *_: None)
    port = emulated_port(refresh=50_000)
    report = examined(port)
    assert len(by_verdict(report, Verdict.BROKEN)) > 150
    assert not by_verdict(report, Verdict.NOT_RUN)
    assert port.clock() < 60  # virtual seconds


def test_a_status_without_response_is_named_by_its_tag(monkeypatch):
    monkeypatch.setattr(Device, "_status", lambda *_: None)
    report = examined(emulated_port(), ["7/pen"])
    (result,) = report.results
    (tag,) = (line.data[1] for line in result.log if line.sent and line.data[0] == 0x40)
    assert f"its tag {tag}," in result.expected


def test_errors_are_shown_whatever_was_waited_for(monkeypatch):
    def data(old, self, session, packet, flags, seq, frame):
        if seq == 1:
            raise PacketError(spec.CODE_PADDING, 3, "something is on")
        old(self, session, packet, flags, seq, frame)

    around(monkeypatch, Device, "_data", data)
    report = examined(emulated_port(refresh=0), ["6/out-of-order-next"])
    (result,) = report.results
    assert len(result.errors) == 2  # that one, and one of STATUS behind it
    assert "PADDING" in result.errors[0]
    shown = "\n".join(violation_lines(result, transcript=False))
    assert "something is on" in shown
    assert "NO_SESSION" in shown
    assert result.errors == as_json("port", report)["checks"][0]["errors"]


@pytest.mark.parametrize(
    ("late", "verdict"), [(1, Verdict.HOLDS), (50, Verdict.NOT_APPLICABLE)], ids=["once", "always"]
)
def test_a_hold_is_not_blamed_for_late_pauses(late, verdict, monkeypatch):
    stay, factors = Dialogue.stay_silent, iter([3] * late)
    monkeypatch.setattr(
        Dialogue, "stay_silent", lambda probe, seconds: stay(probe, seconds * next(factors, 1))
    )
    report = examined(emulated_port(refresh=50_000), ["7.12/held", "7.12/longest-counts"])
    assert report.results[0].verdict is verdict, explain(report)
    assert report.results[1].verdict is (Verdict.HOLDS if late == 1 else verdict), explain(report)


@pytest.mark.parametrize(("early", "verdict"), [(1, Verdict.HOLDS), (2, Verdict.BROKEN)])
def test_a_hold_that_is_over_early_is_looked_at_twice(early, verdict, monkeypatch):
    lengths = iter([0] * early)

    def hold(old, self, ticks):
        old(self, ticks and next(lengths, 1) * ticks)

    around(monkeypatch, Session, "hold", hold)
    report = examined(emulated_port(refresh=50_000), ["7.12/held"])
    assert report.results[0].verdict is verdict, explain(report)


def test_late_responses_are_waited_for_and_counted():
    checks = ["5/info-same", "6/given-up"]
    report = examined(emulated_port(late_s=0.25), checks, timeout_s=0.2)
    assert report.holds, explain(report)
    assert report.late_responses > 0
    assert report.slowest_response_s >= 0.25
    assert "later than the limit" in "\n".join(report_lines(report, transcripts=False))
    assert examined(emulated_port(), checks).late_responses == 0


def test_a_device_without_any_check_does_not_conform():
    report = examined(emulated_port(**DEVICES["bare"]), ["7.3/lines"])
    assert not report.holds
    assert "no check was made" in "\n".join(report_lines(report, transcripts=False))
    assert as_json("port", report)["conforms"] is False


@pytest.mark.parametrize("checks", ["6", "9.1"])
def test_a_pen_that_survives_is_told_from_swapped_axes(checks, monkeypatch):
    (fault,) = (each for each in broken_devices.MUTANTS if each.name == "pen-not-reset")
    fault.make(monkeypatch)
    report = examined(emulated_port(), [checks])
    causes = [result.likely_cause for result in report.results if result.likely_cause]
    assert any("pen is not reset" in cause for cause in causes)
    assert not any("axes" in cause for cause in causes)


def test_every_check_finds_a_fault():
    found = {name for fault in broken_devices.MUTANTS for name in fault.fails}
    unproven = {check.id for check in CHECKS} - found
    assert unproven == broken_devices.UNPROVEN


def test_a_wrong_check_value_is_named(monkeypatch):
    monkeypatch.setattr(crc, "_TABLE", _castagnoli())
    report = examined(emulated_port(), ["3"])
    assert report.device is None
    assert "CRC-32C" in report.results[0].likely_cause
    assert {result.verdict for result in report.results[1:]} == {Verdict.NOT_RUN}


def _castagnoli():
    poly = crc.spec.CRC_POLY
    try:
        crc.spec.CRC_POLY = 0x1EDC6F41
        return crc._table()
    finally:
        crc.spec.CRC_POLY = poly


# -- the list


def test_checks_have_names_of_their_own():
    assert len({check.id for check in CHECKS}) == len(CHECKS)
    assert all(check.requirement for check in CHECKS)
    assert {check.section for check in CHECKS} <= SECTIONS.keys()


def test_choosing():
    assert {check.section for check in select_checks(["7"])} >= {"7", "7.1", "7.8"}
    assert [check.id for check in select_checks(["7.3/line-ties"])] == ["7.3/line-ties"]
    assert {check.name for check in select_checks(["line-*"])} == {"line-ties", "line-of-one"}
    assert "10/ranges" not in {check.id for check in select_checks(["9"])}
    with pytest.raises(ValueError, match="'nothing' matches no check"):
        select_checks(["nothing"])


def test_every_mistake_says_what_it_is():
    assert all(mistake.__doc__ for mistake in DEVICE_BUGS)


def test_the_command_lists_and_refuses(run):
    listed = run("conformance", "--list", "--only", "7.3")
    assert "7.3/line-ties" in listed.stdout
    assert run("conformance", "--only", "no-such").returncode == 2
    assert run("conformance", "--port", "tcp://127.0.0.1:1").returncode == 3


def test_the_command_reports_a_failure(run):
    # The device announces a longer payload than it takes.
    port = "sim:?size=3x5x7&format=mono1&refresh=0&lie=payload"
    failed = run("conformance", "--port", port, "--only", "3", "--timeout", "0.2")
    assert failed.returncode == 1, failed.stderr
    assert "BROKEN 3/longest-packet" in failed.stdout
    assert "must be:" in failed.stdout


@pytest.mark.parametrize("protocol", [2, pickle.HIGHEST_PROTOCOL])
def test_results_and_exceptions_can_be_pickled_and_copied(protocol):
    report = examined(emulated_port(refresh=0), ["5/hello-short", "10/read-refused"])
    report.results.append(replace(report.results[0], check=HANDSHAKE))
    values = [
        *(report, *CHECKS, packets.Response(packets.body(spec.TYPE_ACK, payload=bytes(21)))),
        *(report.device, Page({3: 4}), SavedPage((b"\0",), 7)),
    ]
    for value in values:
        pickled = pickle.dumps(value, protocol)
        for copied in (pickle.loads(pickled), copy.deepcopy(value)):  # noqa: S301 - our own
            assert copied == value
    errors = [
        *(Violation("this", "that", "why"), NoResponse("this", "that"), NotApplicable("so")),
        *(Refused(7, 3), PacketError(7, 3, "why")),
    ]
    for error in errors:
        pickled = pickle.dumps(error, protocol)
        for copied in (pickle.loads(pickled), copy.copy(error)):  # noqa: S301 - our own
            assert type(copied) is type(error)
            assert vars(copied) == vars(error)
            assert str(copied) == str(error)
