"""Recordings: the document's vectors, whole files, and files that are cut off or damaged."""

from __future__ import annotations

import copy
import io
import json
import pickle
import random
import struct
import zlib

import document
import pytest
import recording_document
from recordings import FEATURES, Spin, recording_format, write_recording

import voxdisplay as vd
from voxdisplay.display.plan import EVERY_FEATURE
from voxdisplay.errors import RecordingError
from voxdisplay.shows import recording_spec
from voxdisplay.shows.recording import Recording
from voxdisplay.shows.recording_copy import copy_whole_frames
from voxdisplay.shows.recording_packets import encode_segment, segments
from voxdisplay.shows.recording_writer import RecordingFormat, RecordingWriter, drawing_features
from voxdisplay.shows.show import EncodedFrame, EncodedShow
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.op_listing import list_ops

FORMATS = ("mono1", "index8", "rgb565", "rgb888")


@pytest.fixture(scope="module")
def show():
    return Spin()


@pytest.fixture(scope="module")
def original(show, tmp_path_factory):
    """Path, bytes, frames and recording of a whole file."""
    path = tmp_path_factory.mktemp("recording") / "spin.vxs"
    frames = write_recording(path, show)
    return path, path.read_bytes(), frames, Recording(path)


class Solids(Spin):
    """A ball under a circle whose colours lead from one to another."""

    def __init__(self):
        super().__init__(3)

    def frame(self, number):
        frame = super().frame(number)
        frame.draw(vd.Sphere(center=(6, 5, 4), radius=2 + number / 2, fill="solid"), "teal")
        return frame


def named(name):
    return next(vector for vector in recording_document.vectors() if vector["name"] == name)


class TestDocument:
    def test_literals(self):
        found = {
            name: value
            for name, value in vars(recording_spec).items()
            if name.startswith(("RECORDING_TYPE", "RECORDING_FLAG"))
        }
        assert found == recording_document.literals()

    def test_layouts(self):
        for name, layout in recording_document.layouts().items():
            assert getattr(recording_spec, f"LAYOUT_{name}") == layout

    def test_packets_of_the_vectors_make_the_file(self):
        packets = [bytes.fromhex(v["raw"]) for v in recording_document.vectors() if "raw" in v]
        assert all(zlib.crc32(raw[:-4]) == struct.unpack("<I", raw[-4:])[0] for raw in packets)
        file = b"\0" + b"".join(document.on_wire(raw[:-4]) for raw in packets)
        assert file == bytes.fromhex(named("file")["file"])

    def test_the_vector_is_what_is_written(self, tmp_path):
        path = tmp_path / "two.vxs"
        wanted = RecordingFormat(
            vd.Grid(4, 2, 3),
            vd.PixelFormat("mono1"),
            25_000,
            max_payload=64,
            meta={"name": "two voxels"},
        )
        with RecordingWriter(path, wanted) as writer:
            for voxel in ((1, 0, 0), (3, 1, 2)):
                frame = vd.Frame((4, 2, 3), "mono1")
                frame.draw([voxel])
                writer.append(EncodedFrame(tuple(frame.payloads(64)), frame.digest()))
        assert path.read_bytes() == bytes.fromhex(named("file")["file"])

    def test_the_vector_is_read(self, tmp_path):
        path = tmp_path / "two.vxs"
        path.write_bytes(bytes.fromhex(named("file")["file"]))
        recording = Recording(path)
        assert recording.whole
        assert (recording.frame_count, recording.fps, recording.duration) == (2, 25, 0.08)
        assert [recording.frame(n).lit()[0].tolist() for n in (0, 1)] == [[1], [23]]


class TestWhole:
    def test_frames_are_those_recorded(self, original, show):
        path, _, frames, recording = original
        assert isinstance(recording, EncodedShow)
        assert recording.whole
        assert recording.frame_count == recording.whole_frames == show.frame_count
        assert (recording.fps, recording.loop, recording.duration) == (25, True, 1.6)
        for number in (39, 0, 17, 3):  # in any order
            assert recording.frame(number) == frames[number]
        assert not path.with_name("spin.vxs.part").exists()
        assert "40 frames, 25 fps>" in repr(recording)

    def test_a_device_that_has_what_it_needs_gets_it_as_it_is(self, original):
        *_, frames, recording = original
        found = recording.encoded_frame(5, 64, (*FEATURES, "read"))
        assert found.digest == frames[5].digest()
        assert recording.encoded_frame(5, 64, ("line",)) is None
        longest = max(map(len, recording.recorded_frame(5).payloads))
        assert recording.encoded_frame(5, longest - 1, FEATURES) is None

    def test_it_pickles(self, original):
        *_, frames, recording = original
        assert copy.copy(recording).frame(8) == frames[8]
        assert pickle.loads(pickle.dumps(recording)).frame(8) == frames[8]  # noqa: S301 - ours

    def test_no_such_frame(self, original):
        with pytest.raises(IndexError, match="frames 0 to 39"):
            original[3].frame(40)

    @pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565"])
    def test_formats(self, format_, tmp_path):
        frames = write_recording(tmp_path / "a.vxs", Spin(3, format_))
        recording = Recording(tmp_path / "a.vxs")
        assert [recording.frame(n) for n in range(3)] == frames

    def test_own_palettes(self, tmp_path):
        frame = vd.Frame((12, 10, 9), "index8", own_palette=True)
        frame.draw([(1, 2, 3), (4, 5, 6)], color=[(1, 2, 3), (7, 5, 3)])
        wanted = recording_format(Spin(1, "index8"), features=(*FEATURES, "palette"))
        with RecordingWriter(tmp_path / "a.vxs", wanted) as writer:
            payloads = tuple(frame.payloads(64, wanted.features))
            writer.append(EncodedFrame(payloads, frame.digest()))
        assert Recording(tmp_path / "a.vxs").frame(0) == frame

    @pytest.mark.parametrize("feature", ["slabs", "fade", "arc2"])
    def test_features_of_version_1_1(self, feature, tmp_path):
        path, repaired = tmp_path / "a.vxs", tmp_path / "b.vxs"
        frames = write_recording(
            path, Solids() if feature == "slabs" else Spin(3), features=(feature,), max_payload=1024
        )
        data, recording = path.read_bytes(), Recording(path)
        for kind, at in ((3, 3), (9, 5)):  # HELLO, INFO
            (head,) = (each for each in segments(data) if each.kind == kind)
            assert head.payload[at] == 1, "the minor version that has the feature"
        config = EncoderConfig(vd.Grid(12, 10, 9), vd.PixelFormat.RGB888, 1024)
        payloads = [each for n in range(3) for each in recording.recorded_frame(n).payloads]
        assert feature.upper() in {name for each in payloads for name, _ in list_ops(each, config)}
        assert [recording.frame(number) for number in range(3)] == frames, "it can be decoded"
        assert recording.encoded_frame(1, 1024, FEATURES) is None, "such a device gets it anew"
        assert recording.encoded_frame(1, 1024, (feature,)).digest == frames[1].digest()
        assert copy_whole_frames(recording, repaired).frames == 3
        assert repaired.read_bytes() == data

    def test_only_what_draws_may_be_used(self):
        every = set(EVERY_FEATURE)
        kept = {name: set(drawing_features(vd.PixelFormat(name), every)) for name in FORMATS}
        assert every - kept["index8"] == {"read", "digest", "hold"}
        assert kept["index8"] - kept["mono1"] == {"diff", "palette", "fade", "values"}
        assert kept["index8"] - kept["rgb565"] == {"diff", "palette"}

    def test_times_are_computed_from_the_number(self):
        wanted = recording_format(Spin(), meta={})
        thirds = RecordingFormat(wanted.grid, wanted.format, 30_000)
        assert [thirds.time_of(n) for n in (1, 2, 3, 108_000)] == [333, 667, 1000, 36_000_000]
        for millihertz in (1, 23_976, 30_000, 60_000, 4_000_000):
            each = RecordingFormat(wanted.grid, wanted.format, millihertz)
            assert all(each.number_at(each.time_of(n)) == n for n in range(400))

    def test_an_exception_leaves_the_part(self, tmp_path):
        path = tmp_path / "a.vxs"
        frame = EncodedFrame((b"",), 0)

        def interrupted():
            with RecordingWriter(path, recording_format(Spin())) as writer:
                writer.append(frame)
                writer.append(frame)
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            interrupted()
        assert not path.exists()
        part = Recording(tmp_path / "a.vxs.part")
        assert (part.whole, part.frame_count) == (False, 2)


class TestDamaged:
    @pytest.mark.parametrize("cuts", [60, pytest.param(1000, marks=pytest.mark.slow)])
    def test_all_whole_frames_before_a_cut_are_found(self, original, tmp_path, cuts):
        _, data, frames, recording = original
        ends = []
        for number in range(recording.frame_count):
            found = recording.recorded_frame(number)
            ends.append(found.offset + found.size)
        rng = random.Random(1)
        head = recording.recorded_frame(0).offset
        for cut in rng.sample(range(head, len(data) - 1), cuts):
            path = tmp_path / "cut.vxs"
            path.write_bytes(data[:cut])
            left = Recording(path)
            assert not left.whole
            whole = sum(end <= cut for end in ends)
            assert left.whole_frames == whole
            if whole:
                assert left.frame(whole - 1) == frames[whole - 1]

    def test_a_flipped_bit_costs_one_frame_at_most(self, original, tmp_path):
        _, data, frames, recording = original
        rng = random.Random(2)
        for at in rng.sample(range(recording.recorded_frame(0).offset, len(data)), 60):
            damaged = bytearray(data)
            damaged[at] ^= 1 << rng.randrange(8)
            path = tmp_path / "flip.vxs"
            path.write_bytes(damaged)
            repaired = tmp_path / "repaired.vxs"
            result = copy_whole_frames(Recording(path), repaired)
            assert result.lost <= 1
            again = Recording(repaired)
            assert again.whole
            assert again.frame_count >= len(frames) - 1
            right = [again.frame(n) == frames[n] for n in range(again.frame_count)]
            assert right.count(False) <= 1

    def test_packets_of_unknown_types_are_kept(self, original, tmp_path):
        _, data, frames, recording = original
        at = recording.recorded_frame(3).offset
        strange = encode_segment(13, 5, 1, 2, b"later versions")
        path = tmp_path / "a.vxs"
        path.write_bytes(data[:at] + strange + data[at:])
        longer = Recording(path)
        assert not longer.whole  # its index is of the file before
        copy_whole_frames(longer, tmp_path / "b.vxs")
        again = Recording(tmp_path / "b.vxs")
        assert again.whole
        assert [again.frame(n) for n in range(40)] == frames
        assert strange in (tmp_path / "b.vxs").read_bytes()

    def test_unknown_keys_of_meta_are_kept(self, tmp_path):
        path = tmp_path / "a.vxs"
        write_recording(path, Spin(2), meta={"orientation": ["x", "-z", "y"]})
        copy_whole_frames(Recording(path), tmp_path / "b.vxs")
        assert (tmp_path / "b.vxs").read_bytes() == path.read_bytes()

    def test_a_repair_does_not_replace_its_source(self, original):
        path, _, _, recording = original
        with pytest.raises(RecordingError, match="would be replaced"):
            copy_whole_frames(recording, path)


def with_head(data, **changes):
    """Return a file with another META or INFO."""
    found = list(segments(data))
    out = io.BytesIO()
    out.write(b"\0")
    for segment in found:
        payload = segment.payload
        if segment.kind == recording_spec.RECORDING_TYPE_META and "meta" in changes:
            payload = changes["meta"]
        if segment.kind == 9 and "info" in changes:
            at, new = changes["info"]
            payload = payload[:at] + new + payload[at + len(new) :]
        out.write(encode_segment(segment.kind, segment.flags, segment.seq, segment.frame, payload))
    return out.getvalue()


class TestHostile:
    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"meta": b"{"}, "no JSON"),
            ({"meta": b"[" * 5000}, "no JSON"),
            ({"meta": b"[]"}, "no version"),
            ({"meta": b'{"version": 2}'}, "version 2.*reads version 1"),
            ({"info": (0, b"\x02")}, "display"),  # another major
            ({"info": (6, b"\x09")}, "display"),  # an unknown pixel format
            ({"info": (21, bytes(4))}, "display"),  # no frames in any time
            ({"info": (25, b"\x0f\x10")}, "HOLD.*FRAMEs say when"),
            ({"info": (7, bytes(2))}, "nx|grid|Grid|size"),
        ],
    )
    def test_heads(self, original, tmp_path, change, message):
        path = tmp_path / "a.vxs"
        path.write_bytes(with_head(original[1], **change))
        with pytest.raises(RecordingError, match=message):
            Recording(path)

    @pytest.mark.parametrize("data", [b"", b"\0", b"GIF89a" * 100, bytes(5000)])
    def test_other_files(self, tmp_path, data):
        path = tmp_path / "a.vxs"
        path.write_bytes(data)
        with pytest.raises(RecordingError, match="no recording"):
            Recording(path)

    @pytest.mark.parametrize(
        "end",
        [
            (2**63, 40, 16_000),  # an index behind the file
            (0, 2**32 - 1, 16_000),  # a billion frames
            (5, 0, 0),
        ],
    )
    def test_a_hostile_end_is_not_believed(self, original, tmp_path, end):
        _, data, frames, _ = original
        at = data.rfind(b"\0", 0, len(data) - 1) + 1
        path = tmp_path / "a.vxs"
        path.write_bytes(data[:at] + encode_segment(7, 1, 0, 0, struct.pack("<QII", *end)))
        recording = Recording(path)
        assert not recording.whole
        assert recording.frame_count == 40
        assert recording.frame(39) == frames[39]

    def test_an_index_of_other_places_is_not_believed(self, original, tmp_path):
        _, data, frames, _ = original
        found = list(segments(data))
        index = next(s for s in found if s.kind == 7 and not s.flags)
        broken = index.payload[:4] + struct.pack("<Q", 2**40) + index.payload[12:]
        path = tmp_path / "a.vxs"
        end = data[index.offset + index.size :]
        path.write_bytes(data[: index.offset] + encode_segment(7, 0, 0, 0, broken) + end)
        left = Recording(path)
        assert not left.whole
        assert left.frame(12) == frames[12]

    def test_frames_far_ahead_are_left_out(self, original, tmp_path):
        _, data, *_ = original
        found = list(segments(data))
        out = b"\0"
        for segment in found[:-2]:
            payload = segment.payload
            if segment.kind == 6 and segment.frame == 20:
                payload = struct.pack("<I", 2**32 - 1) + payload[4:]
            out += encode_segment(segment.kind, segment.flags, segment.seq, segment.frame, payload)
        path = tmp_path / "a.vxs"
        path.write_bytes(out)
        left = Recording(path)
        assert (left.frame_count, left.whole_frames) == (40, 39)
        assert left.frame(20) == left.frame(19)

    def test_a_frame_that_draws_something_else_is_found(self, original, tmp_path):
        _, data, *_ = original
        out = b"\0"
        for segment in segments(data):
            payload = segment.payload
            if segment.kind == 6 and segment.frame == 2:
                payload = payload[:4] + b"\1\2\3\4" + payload[8:]
            out += encode_segment(segment.kind, segment.flags, segment.seq, segment.frame, payload)
        path = tmp_path / "a.vxs"
        path.write_bytes(out)
        recording = Recording(path)
        with pytest.raises(RecordingError, match="frame 2 draws something else"):
            recording.frame(2)

    def test_any_bytes(self, original, tmp_path):
        _, data, *_ = original
        rng = random.Random(7)
        path = tmp_path / "a.vxs"
        for _ in range(150):
            broken = bytearray(data)
            for _ in range(rng.randrange(1, 60)):
                broken[rng.randrange(len(broken))] = rng.randrange(256)
            path.write_bytes(broken)
            try:
                recording = Recording(path)
                for number in range(recording.frame_count):
                    recording.frame(number)
            except RecordingError:
                pass

    def test_meta_must_fit_a_packet(self, tmp_path):
        wanted = recording_format(Spin(), meta={"scene": "x" * 70_000})
        with pytest.raises(vd.VoxDisplayError, match="META has"):
            RecordingWriter(tmp_path / "a.vxs", wanted)

    def test_a_folder_that_is_not_there(self, tmp_path):
        with pytest.raises(vd.VoxDisplayError, match=r"cannot write .*No such file"):
            RecordingWriter(tmp_path / "none" / "a.vxs", recording_format(Spin()))

    def test_shows_of_more_than_119_hours(self, tmp_path):
        wanted = RecordingFormat(vd.Grid(4, 2, 3), vd.PixelFormat("mono1"), 1)
        with RecordingWriter(tmp_path / "a.vxs", wanted) as writer:
            for _ in range(430):
                writer.append(EncodedFrame((b"",), 0))
            with pytest.raises(vd.VoxDisplayError, match="at most 429497 s"):
                writer.append(EncodedFrame((b"",), 0))


def test_meta_is_json(original):
    meta = next(s for s in segments(original[1]) if s.kind == recording_spec.RECORDING_TYPE_META)
    assert json.loads(meta.payload) == {"version": 1, "loop": True, "name": "spin"}
