"""Volumes: arrays, NRRD, NIfTI, TIFF and DICOM; bombs, false headers, cut and changed bytes."""

import bz2
import gzip
import io
import zipfile

import numpy as np
import pytest

from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files import fitted, load_body
from voxdisplay.files.array_files import read_npy, read_npz, read_raw, samples_of
from voxdisplay.files.dicom_series import read_dicom
from voxdisplay.files.nifti import read_nifti
from voxdisplay.files.nrrd_volume import read_nrrd
from voxdisplay.files.tiff_stack import read_tiff
from voxdisplay.files.volume_axes import to_canonical

VALUES = np.arange(105, dtype=np.int16).reshape(7, 5, 3)


def npy(array, **options):
    file = io.BytesIO()
    np.save(file, array, **options)
    return file.getvalue()


def npz(**arrays):
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def nrrd(encoding="raw", content=None, **fields):
    lines = {"type": "short", "dimension": 3, "sizes": "3 5 7", "endian": "little",
             "encoding": encoding, **fields}  # fmt: skip
    head = "NRRD0004\n" + "".join(f"{key}: {value}\n" for key, value in lines.items())
    packed = {"raw": bytes, "gzip": gzip.compress, "bzip2": bz2.compress}
    body = packed[encoding](VALUES.tobytes()) if content is None else content
    return head.encode() + b"\n" + body


def nifti(array=VALUES, affine=None, **changes):
    nibabel = pytest.importorskip("nibabel", reason="needs the extra volume")
    image = nibabel.Nifti1Image(array.T, np.eye(4) if affine is None else affine)
    for key, value in changes.items():
        image.header[key] = value
    return image.to_bytes()


def tiff(pages=VALUES, **options):
    image = pytest.importorskip("PIL.Image", reason="needs the extra view")
    images = [image.fromarray(page.astype(np.uint16)) for page in pages]
    file = io.BytesIO()
    images[0].save(file, "TIFF", save_all=True, append_images=images[1:], **options)
    return file.getvalue()


def dicom(k=0, **changes):
    pydicom = pytest.importorskip("pydicom", reason="needs the extra volume")
    dataset = pydicom.Dataset()
    dataset.file_meta = pydicom.dataset.FileMetaDataset()
    dataset.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    dataset.SOPClassUID, dataset.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.2", f"1.2.3.{k}"
    dataset.SeriesInstanceUID = "1.2.4"
    dataset.Rows, dataset.Columns, dataset.SamplesPerPixel = 5, 3, 1
    dataset.PhotometricInterpretation = "MONOCHROME2"
    dataset.BitsAllocated = dataset.BitsStored = 16
    dataset.HighBit, dataset.PixelRepresentation = 15, 1
    dataset.PixelSpacing, dataset.SliceThickness = [1, 1], 2
    dataset.ImagePositionPatient = [0, 0, 2 * k]
    dataset.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    dataset.PixelData = VALUES[k].tobytes()
    for key, value in changes.items():
        setattr(dataset, key, value)
    file = io.BytesIO()
    pydicom.dcmwrite(file, dataset, enforce_file_format=True)
    return file.getvalue()


def series(data):
    return read_dicom([("some.dcm", data)])


def refused(read, data, words, *more):
    with pytest.raises(BodyError, match=words) as caught:
        read("some", data, *more)
    assert "some" in str(caught.value)


def test_arrays_of_pickles_are_refused():
    refused(read_npy, npy(np.array([{}, None]), allow_pickle=True), "Python objects")
    refused(read_npz, npz(a=np.array([{}], dtype=object)), "none")
    refused(read_npy, npy(np.zeros(3, dtype=[("a", "i4")])), "not an array of real")
    refused(read_npy, npy(np.zeros(3, dtype=complex)), "not an array of real")


def test_arrays_that_claim_too_much_are_refused():
    data = npy(VALUES)
    huge = data.replace(b"(7, 5, 3)", b"(9999999, 5, 3)")
    refused(read_npy, huge, "claims")
    refused(read_npy, data.replace(b"<i2", b"<f8"), "claims")
    refused(read_npy, data[:-1], "claims")
    refused(read_npy, b"", "not a .npy")
    refused(samples_of, np.zeros((3, 5)), "3 x 5")


def test_an_archive_has_voxels_or_one_volume():
    found = read_npz("a", npz(voxels=np.array([(1, 2, 3)]), colors=np.array([(4, 5, 6)], "u1")))
    assert found.voxels.tolist() == [[1, 2, 3]]
    assert found.colors.tolist() == [[4, 5, 6]]
    assert np.array_equal(read_npz("a", npz(any=VALUES, scale=2.0)).values, VALUES)
    refused(read_npz, npz(a=VALUES, b=VALUES), "holds a, b")
    refused(read_npz, npz(voxels=np.zeros((2, 2), int)), "voxels are whole")
    refused(read_npz, npz(voxels=np.zeros((0, 3), int)), "no voxels")
    refused(read_npz, npz(voxels=np.full((1, 3), 1 << 40)), "further away")
    refused(read_npz, npz(voxels=np.zeros((1, 3), int), colors=np.zeros((2, 3), "u1")), "colors")


def test_archive_bombs_are_refused():
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", npy(VALUES) + bytes(200 << 20))
    refused(read_npz, file.getvalue(), "claims|unpacked")
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for i in range(1001):
            archive.writestr(f"{i}.npy", b"")
    refused(read_npz, file.getvalue(), "1001 members")
    refused(read_npz, b"PK\3\4" + bytes(40), "archive")


def test_raw_files_need_shape_and_type():
    found = read_raw("a", VALUES.astype(">i2").tobytes(), [7, 5, 3], ">i2")
    assert np.array_equal(found.values, VALUES)
    refused(read_raw, b"12", "give shape", None, "u1")
    refused(read_raw, b"12", "2 bytes; 7 x 5 x 3 of int16 are 210", [7, 5, 3], "int16")
    for wrong in ("O", "void", "u1,u1", "M8", "float128x", "i9"):
        with pytest.raises(BodyError, match="dtype"):
            read_raw("a", b"12", [1, 1, 2], wrong)
    with pytest.raises(BodyError, match="shape"):
        read_raw("a", b"12", [0, 1, 2], "u1")


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2"])
def test_nrrd_samples_and_axes(encoding):
    pytest.importorskip("nrrd", reason="needs the extra volume")
    fields = {"space": "left-posterior-superior", "space directions": "(0,2,0) (0,0,3) (-1,0,0)"}
    found = read_nrrd("a", nrrd(encoding, **fields))
    # File axes run to anterior backwards, up, and to the right.
    assert found.spacing == (1, 2, 3)
    assert np.array_equal(found.values, VALUES.transpose(1, 2, 0)[:, ::-1, :])
    assert read_nrrd("a", nrrd(spacings="1 1 2.5")).spacing == (1, 1, 2.5)
    assert read_nrrd("a", nrrd(spacings="1 nan 2.5")).spacing == (1, 1, 2.5)


def test_nrrd_colors_are_averaged():
    pytest.importorskip("nrrd", reason="needs the extra volume")
    fields = {"dimension": 4, "sizes": "3 5 7 1", "space": "RAS",
              "space directions": "none (1,0,0) (0,1,0) (0,0,1)"}  # fmt: skip
    found = read_nrrd("a", nrrd(**fields))
    assert np.allclose(found.values, VALUES.mean(axis=2)[None])
    assert "3 values" in found.notes[0]


def test_nrrd_headers_that_lie_are_refused(tmp_path):
    pytest.importorskip("nrrd", reason="needs the extra volume")
    refused(read_nrrd, nrrd(sizes="1000000 1000000 1"), "claims")
    refused(read_nrrd, nrrd(sizes="3 5 -7"), "claims")
    refused(read_nrrd, nrrd(sizes="3 5 8"), "cut off")
    refused(read_nrrd, nrrd(type="block"), "type")
    refused(
        read_nrrd, nrrd(**{"space directions": "(0,0,0) (0,1,0) (0,0,1)", "space": "RAS"}), "axes"
    )
    refused(read_nrrd, b"NRRD0004\n", "header|claims|type")
    refused(read_nrrd, nrrd("gzip", content=gzip.compress(VALUES.tobytes())[:20]), "cut off|damag")
    for other in ("../v.raw", "/etc/hostname", "LIST", "v%03d.raw 1 2 1", "nowhere.raw"):
        (tmp_path / "inner").mkdir(exist_ok=True)
        (tmp_path / "v.raw").write_bytes(VALUES.tobytes())
        with pytest.raises(BodyError, match=r"outside|several|no file"):
            read_nrrd("a", nrrd(**{"data file": other}), tmp_path / "inner")


def test_a_gzip_bomb_is_not_unpacked():
    pytest.importorskip("nrrd", reason="needs the extra volume")
    bomb = gzip.compress(VALUES.tobytes() + bytes(64 << 20), 1)
    assert np.array_equal(read_nrrd("a", nrrd("gzip", content=bomb)).values, VALUES)
    plain = nifti()
    assert np.array_equal(read_nifti("a", gzip.compress(plain + bytes(64 << 20), 1)).values, VALUES)


def test_nifti_axes_scale_and_time():
    found = read_nifti("a", nifti(affine=np.diag([-2.0, 1, 3, 1])))
    assert found.spacing == (2, 1, 3)
    assert np.array_equal(found.values, VALUES[:, :, ::-1])
    scaled = read_nifti("a", nifti(scl_slope=0.5, scl_inter=-10))
    assert np.allclose(scaled.values, VALUES * 0.5 - 10)
    frames = read_nifti("a", nifti(np.stack((VALUES, VALUES + 1))))
    assert np.array_equal(frames.values, VALUES)
    assert "2 volumes" in frames.notes[0]
    turned = np.eye(4)
    turned[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    assert "oblique by 37" in read_nifti("a", nifti(affine=turned)).notes[0]


def test_nifti_headers_that_lie_are_refused():
    data = nifti()
    refused(read_nifti, data[:-1], "cut off")
    refused(read_nifti, b"", "header")
    changed = bytearray(data)
    changed[42:48] = b"\xff\x7f" * 3
    refused(read_nifti, bytes(changed), "claims")
    changed = bytearray(data)
    changed[108:112] = np.float32(1e30).tobytes()
    refused(read_nifti, bytes(changed), "begin|header")
    refused(read_nifti, nifti(VALUES.astype(np.complex64)), "complex64")


@pytest.mark.parametrize("compression", [None, "tiff_lzw", "tiff_adobe_deflate", "packbits"])
def test_tiff_pages_are_planes(compression):
    assert np.array_equal(read_tiff("a", tiff(compression=compression)).values, VALUES)


def test_tiff_files_that_are_damaged_are_refused():
    data = tiff()
    refused(read_tiff, b"MM\0*" + bytes(20), "cannot be read")
    refused(read_tiff, b"RIFF", "not a TIFF")
    refused(read_tiff, data[: len(data) // 2], "cannot be read")
    image = pytest.importorskip("PIL.Image")
    file = io.BytesIO()
    first, second = image.new("L", (3, 5)), image.new("L", (5, 3))
    first.save(file, "TIFF", save_all=True, append_images=[second])
    refused(read_tiff, file.getvalue(), "page 2")


def test_dicom_slices_are_sorted_scaled_and_windowed():
    scale = {"RescaleSlope": 2, "RescaleIntercept": -1000, "WindowCenter": [40, 50],
             "WindowWidth": [101, 3]}  # fmt: skip
    files = [(f"{k}.dcm", dicom(k, **scale)) for k in (3, 1, 0, 2, 6, 5, 4)]
    found = read_dicom([*files, ("other.dcm", dicom(0, SeriesInstanceUID="1.9")), ("no.dcm", b"")])
    assert np.array_equal(found.values, 2.0 * VALUES[:, ::-1, ::-1] - 1000)
    assert found.spacing == (1, 1, 2)
    assert found.window == (-10.5, 89.5)
    assert len(found.notes) == 2
    assert np.array_equal(read_dicom(reversed(files)).values, found.values)


def test_dicom_series_with_gaps_and_doubles_are_noted():
    files = [(f"{k}.dcm", dicom(k)) for k in (0, 1, 2, 3, 6)]
    assert "apart" in read_dicom(files).notes[0]
    double = [*files[:3], ("again.dcm", dicom(1))]
    found = read_dicom(double)
    assert len(found.values) == 3
    assert "one already" in found.notes[0]


def test_dicom_files_that_lie_or_differ_are_refused():
    with pytest.raises(BodyError, match="not a DICOM"):
        series(b"x" * 200)
    with pytest.raises(BodyError, match="claims"):
        series(dicom(Rows=65535, Columns=65535))
    with pytest.raises(BodyError, match="image cannot be read"):
        series(dicom(PixelData=b"\0\0"))
    with pytest.raises(BodyError, match="another size"):
        read_dicom([("a.dcm", dicom(0)), ("b.dcm", dicom(1, Rows=3, Columns=5))])
    with pytest.raises(BodyError, match="turned"):
        read_dicom([("a.dcm", dicom(0)),
                    ("b.dcm", dicom(1, ImageOrientationPatient=[0, 1, 0, 1, 0, 0]))])  # fmt: skip
    with pytest.raises(BodyError, match="deflated"):
        series(dicom(0).replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2.1.99"))


def test_a_folder_is_a_series(tmp_path):
    for k in range(7):
        (tmp_path / f"IM{k}").write_bytes(dicom(k))
    (tmp_path / "notes.txt").write_text("no image", encoding="ascii")
    body = load_body(tmp_path).body
    assert np.allclose(body.bounds()[1], (3, 5, 14))
    outside = tmp_path.parent / f"{tmp_path.name} outside.dcm"
    outside.write_bytes(dicom(0))
    (tmp_path / "link.dcm").symlink_to(outside)
    with pytest.raises(BodyError, match="leads outside"):
        load_body(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(BodyError, match="without a DICOM"):
        load_body(tmp_path / "empty")


def test_axes_are_turned_and_never_sheared():
    values = VALUES.T
    for order in ((0, 1, 2), (2, 0, 1), (1, 0, 2)):
        for signs in ((1, 1, 1), (-1, 1, -1)):
            steps = np.zeros((3, 3))
            for axis, (target, sign) in enumerate(zip(order, signs, strict=True)):
                steps[target, axis] = sign * (axis + 1)
            turned, spacing, note = to_canonical(values, steps)
            assert note is None
            assert sorted(spacing) == [1, 2, 3]
            assert turned.size == values.size
            back, _, _ = to_canonical(turned.transpose(2, 1, 0), np.diag(spacing))
            assert np.array_equal(back, turned)


def test_spacing_enters_the_fit(tmp_path):
    (tmp_path / "a.nii").write_bytes(nifti(affine=np.diag([2.0, 1, 3, 1])))
    body, scale = fitted(load_body(tmp_path / "a.nii").body, (0, 0, 0), (42, 42, 42))
    assert scale == 2
    assert np.allclose(body.bounds(), [(15, 16, 0), (27, 26, 42)])


@pytest.mark.parametrize("module", ["nrrd", "nibabel", "pydicom", "PIL"])
def test_without_a_library_the_error_names_the_extra(module, monkeypatch):
    made = {"nrrd": (read_nrrd, nrrd), "nibabel": (read_nifti, nifti), "PIL": (read_tiff, tiff),
            "pydicom": (lambda _, data: series(data), dicom)}  # fmt: skip
    read, make = made[module]
    data = make()
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MissingExtra) as caught:
        read("a", data)
    assert "pip install" in caught.value.hint


WHOLE = {
    "npy": (read_npy, lambda: npy(VALUES)),
    "npz": (read_npz, lambda: npz(volume=VALUES)),
    "nrrd": (read_nrrd, nrrd),
    "nrrd, gzip": (read_nrrd, lambda: nrrd("gzip")),
    "nrrd, bzip2": (read_nrrd, lambda: nrrd("bzip2")),
    "nifti": (read_nifti, nifti),
    "nifti, gzip": (read_nifti, lambda: gzip.compress(nifti())),
    "tiff": (read_tiff, tiff),
    "tiff, lzw": (read_tiff, lambda: tiff(compression="tiff_lzw")),
    "dicom": (lambda _, data: series(data), dicom),
}


@pytest.mark.parametrize("name", WHOLE)
def test_files_cut_off_at_any_byte_are_refused(name):
    read, make = WHOLE[name]
    data = make()
    if "nrrd" in name:
        pytest.importorskip("nrrd", reason="needs the extra volume")
    read("whole", data)
    for end in range(len(data)):
        try:
            read("cut", data[:end])
        except BodyError:
            continue
        # The check values at the ends of compressed streams are not needed for the samples.
        assert "gzip" in name or "bzip2" in name or ("tiff" in name and end > 100), end


@pytest.mark.parametrize("name", WHOLE)
def test_changed_bytes_are_read_or_refused(name):
    read, make = WHOLE[name]
    data = make()
    if "nrrd" in name:
        pytest.importorskip("nrrd", reason="needs the extra volume")
    random = np.random.default_rng(17)
    for _ in range(300):
        changed = np.frombuffer(data, np.uint8).copy()
        at = random.integers(0, len(changed), size=int(random.integers(1, 6)))
        changed[at] = random.choice([0, 32, 45, 57, 127, 255, int(random.integers(256))], len(at))
        try:
            read("changed", changed.tobytes())
        except (BodyError, MissingExtra):
            continue


def test_compressed_samples_that_grow_beyond_reason_are_refused():
    pytest.importorskip("nrrd", reason="needs the extra volume")
    zeros = gzip.compress(bytes(1 << 20)) * 300  # 300 MiB in 300 members
    refused(read_nrrd, nrrd("gzip", content=zeros, sizes="3 5 10000000"), "MiB unpacked")
    huge = bytearray(nifti())
    huge[42:48] = np.array([1000, 1000, 500], "<i2").tobytes()
    refused(read_nifti, gzip.compress(bytes(huge)), "MiB unpacked")
    image = pytest.importorskip("PIL.Image")
    file = io.BytesIO()
    image.new("L", (10_000, 10_000)).save(file, "TIFF", compression="tiff_adobe_deflate")
    refused(read_tiff, file.getvalue(), "MiB unpacked")
    file = io.BytesIO()
    np.savez_compressed(file, a=np.zeros((512, 512, 512), np.uint8))
    refused(read_npz, file.getvalue(), "MiB unpacked")
