"""Text: letters as regions, prisms and outlines; scripts, directions, fonts that are none."""

import unicodedata
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.bodies import outline_triangulation
from voxdisplay.bodies.bidirectional_text import visual_runs
from voxdisplay.bodies.glyphs import choose_font
from voxdisplay.bodies.outline_triangulation import triangulate

pytest.importorskip("uharfbuzz", reason="needs the extra text")
fontpkg = pytest.importorskip("fontpkg", reason="needs the extra text")
FONT = fontpkg.path("Noto Sans")


def mesh_of(text):
    geometry = text.geometry(text.bounds())
    return geometry.vertices, geometry.faces


def is_closed(faces):
    """Every edge is passed as often forward as backward."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()
    count = Counter(map(tuple, edges))
    return all(count[end, start] == times for (start, end), times in count.items())


def volume_of(vertices, faces):
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def area_of(region):
    a, b, c = (region.points[region.triangles[:, i]] for i in range(3))
    (x, y), (u, v) = (b - a).T, (c - a).T
    cross = x * v - y * u
    assert (cross >= 0).all(), "counter-clockwise"
    return float(cross.sum() / 2)


SQUARE = np.array([(0, 0), (8, 0), (8, 8), (0, 8)], dtype=float)


@pytest.mark.parametrize(
    ("outlines", "area"),
    [
        ([SQUARE], 64),
        ([SQUARE[::-1]], 64),
        ([SQUARE, SQUARE[::-1] / 2 + 2], 48),  # a hole
        ([SQUARE, SQUARE / 2 + 2], 64),  # no hole: it turns the same way
        ([SQUARE, SQUARE + 4], 112),  # overlapping
        ([SQUARE, SQUARE], 64),
        ([SQUARE, SQUARE + np.array([8, 0])], 128),  # side by side
        ([np.array([(0, 0), (8, 8), (8, 0), (0, 8)], float)], 32),  # crossing itself
        ([np.array([(0, 0), (9, 1), (2, 7)], float)], 30.5),
        ([SQUARE[:2]], 0),
        ([], 0),
    ],
)  # fmt: skip
def test_regions_have_the_area_of_what_is_inside(outlines, area):
    region = triangulate(outlines)
    assert area_of(region) == pytest.approx(area, abs=0.05)


def winding(outlines, point):
    """Winding number of outlines around a point, by a ray to the right."""
    total = 0
    for outline in outlines:
        for (x, y), (u, v) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            if (y > point[1]) != (v > point[1]):
                cross = x + (point[1] - y) / (v - y) * (u - x)
                total += (1 if v > y else -1) * (cross > point[0])
    return total


def is_near_an_edge(outlines, point):
    for outline in outlines:
        start, along = outline, np.roll(outline, -1, axis=0) - outline
        part = ((point - start) * along).sum(axis=1) / (along**2).sum(axis=1)
        nearest = start + part.clip(0, 1)[:, None] * along
        if np.linalg.norm(nearest - point, axis=1).min() < 0.1:
            return True
    return False


def is_in_a_triangle(region, point):
    a, b, c = (region.points[region.triangles[:, i]] for i in range(3))

    def side(p, q):
        return (q - p)[:, 0] * (point - p)[:, 1] - (q - p)[:, 1] * (point - p)[:, 0]

    return bool(((side(a, b) >= 0) & (side(b, c) >= 0) & (side(c, a) >= 0)).any())


@pytest.mark.parametrize("seed", range(40))
def test_regions_of_random_outlines_are_those_of_winding_numbers(seed):
    random = np.random.default_rng(seed)
    outlines = [random.uniform(0, 20, size=(random.integers(3, 9), 2)) for _ in range(3)]
    region = triangulate(outlines)
    for point in random.uniform(0, 20, size=(400, 2)):
        if not is_near_an_edge(outlines, point):
            assert is_in_a_triangle(region, point) == (winding(outlines, point) != 0)
    edges = np.concatenate([region.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    count = Counter(map(tuple, edges.tolist()))
    count.subtract(map(tuple, region.boundary.tolist()))
    assert all(times == count[end, start] for (start, end), times in list(count.items()))


@pytest.mark.parametrize(
    "text", ["Hamburg", "g&@%8", "two\nlines", "Ärger é Ω ж", "नमस्ते", "ffi 1/2"]
)
def test_letters_with_a_depth_are_closed_and_turned_outward(text):
    vertices, faces = mesh_of(vd.Text(text, (3, 5, 7), 16, depth=3, font=FONT))
    assert is_closed(faces)
    flat = vd.Text(text, (3, 5, 7), 16, font=FONT)
    points, triangles = mesh_of(flat)
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert volume_of(vertices, faces) == pytest.approx(3 * area, rel=1e-6)


def test_flat_letters_are_not_called_open():
    assert vd.voxelize(vd.Text("aO", (1, 1, 1), 9, font=FONT)).notes == ()


def test_height_is_that_of_capitals_and_at_the_baseline():
    low, high = vd.Text("HH", (10, 20, 30), 24, font=FONT).bounds()
    assert low[2] == pytest.approx(30)
    assert high[2] == pytest.approx(54)
    assert low[1] == high[1] == 20
    assert 10 <= low[0] < 14


def test_direction_up_and_depth():
    text = vd.Text("HH", (0, 0, 0), 10, direction=(0, 2, 0), up=(0, 5, -1), depth=4, font=FONT)
    low, high = text.bounds()
    assert np.allclose([low[2], high[2]], [-10, 0])
    # Lines to y and up to -z: the reader is at -x, so the depth is towards x.
    assert np.allclose([low[0], high[0]], [0, 4])


def test_solid_letters_fill_their_shells():
    shell = vd.voxelize(vd.Text("B8", (2, 9, 3), 24, depth=9, font=FONT)).voxels
    solid = vd.voxelize(vd.Text("B8", (2, 9, 3), 24, depth=9, fill="solid", font=FONT)).voxels
    assert len(solid) > 1.1 * len(shell)
    flat = vd.Text("B8", (2, 9.5, 3), 24, fill="solid", font=FONT)
    assert flat.kind == "surface"
    assert set(vd.voxelize(flat).voxels[:, 1]) == {9}


def test_outlines_are_closed_curves():
    outlines = vd.Text("B8", (2, 9, 3), 24, font=FONT).outlines()
    assert len(outlines) >= 6
    for outline in outlines:
        report = vd.voxelize(outline).report
        assert report.closed
        assert report.gaps == 0


def test_lines_run_downward():
    one, two = (vd.Text(text, (0, 0, 100), 10, font=FONT).bounds() for text in ("H", "H\nH"))
    assert one[1][2] == two[1][2]
    assert two[0][2] < one[0][2] - 10


HEBREW, ARABIC = "\u05e9\u05dc\u05d5\u05dd", "\u0645\u0631\u062d\u0628\u0627"


@pytest.mark.parametrize(
    ("text", "runs"),
    [
        ("abc", ["abc"]),
        (HEBREW, [HEBREW]),
        (f"ab {HEBREW} cd", ["ab ", HEBREW, " cd"]),
        (f"{HEBREW} ab", ["ab", f"{HEBREW} "]),
        (f"{HEBREW} 12", ["12", f"{HEBREW} "]),
        (f"a {HEBREW} 12", ["a ", "12", f"{HEBREW} "]),
        (f"{HEBREW} ab 12 {ARABIC}", [f" {ARABIC}", "ab 12", f"{HEBREW} "]),
        ("a\u0301b", ["a\u0301b"]),
        ("1 + 2", ["1 + 2"]),
        ("", []),
    ],
)
def test_runs_stand_in_the_order_in_which_they_are_seen(text, runs):
    assert [text[start:end] for start, end, _ in visual_runs(text)] == runs


def system_font_with(letters):
    try:
        return choose_font(letters)
    except vd.BodyError:
        pytest.skip(f"no font of this system has {unicodedata.name(letters[0])}")


def width_of(text):
    low, high = vd.Text(text, (0, 0, 0), 20).bounds()
    return high[0] - low[0]


def test_right_to_left_is_set_from_the_right():
    system_font_with(HEBREW)
    word = vd.Text(HEBREW, (0, 0, 0), 20)
    # The last outlines from left to right are those of the first letter.
    right = vd.voxelize(word.outlines()[-1]).voxels[:, 0]
    assert right.max() == pytest.approx(word.bounds()[1][0], abs=1)
    assert np.ptp(right) == pytest.approx(width_of(HEBREW[0]), abs=2)


def test_arabic_letters_join():
    system_font_with(ARABIC)
    apart = sum(len(vd.Text(letter, (0, 0, 0), 20).outlines()) for letter in ARABIC)
    wide = sum(width_of(letter) for letter in ARABIC)
    word = vd.Text(ARABIC, (0, 0, 0), 20)
    assert width_of(ARABIC) < wide
    assert len(word.outlines()) <= apart


def test_marks_stand_above_their_letters():
    plain = vd.Text("e", (0, 0, 0), 20, font=FONT).bounds()
    marked = vd.Text("e\u0301", (0, 0, 0), 20, font=FONT).bounds()
    assert marked[1][2] > plain[1][2] + 2
    assert np.allclose([plain[0][0], plain[1][0]], [marked[0][0], marked[1][0]], atol=1)


def test_characters_that_a_font_lacks_are_named():
    with pytest.raises(vd.BodyError, match="HEBREW LETTER SHIN") as caught:
        vd.Text(f"ab {HEBREW}", (0, 0, 0), 20, font=FONT)
    assert "NotoSans" in str(caught.value)
    assert "font" in caught.value.hint
    with pytest.raises(vd.BodyError, match="and 3 more"):
        vd.Text("\u3042\u3044\u3046\u3048\u304a\u304b\u304d\u304f", (0, 0, 0), 20, font=FONT)


def test_without_a_named_font_one_that_has_all_is_chosen():
    assert "NotoSans" in repr(vd.Text("Abc", (0, 0, 0), 20))


@pytest.mark.parametrize(
    "data", [b"", b"no font", b"wOFF" + bytes(60), b"\0\1\0\0", b"OTTO" + b"\xff" * 300]
)
def test_fonts_that_are_no_fonts_are_refused(data):
    with pytest.raises(vd.BodyError, match="font"):
        vd.Text("Abc", (0, 0, 0), 20, font=data)


def test_fonts_cut_off_or_damaged_draw_or_are_refused():
    whole = Path(FONT).read_bytes()
    random = np.random.default_rng(7)
    for trial in range(120):
        if trial % 2:
            data = whole[: random.integers(0, len(whole))]
        else:
            changed = np.frombuffer(whole, np.uint8).copy()
            at = random.integers(0, [400, len(whole)][trial // 2 % 2], size=20)
            changed[at] = random.integers(0, 256, size=20)
            data = changed.tobytes()
        try:
            vd.Text("Ag\u00e9", (0, 0, 0), 20, font=data)
        except vd.BodyError:
            continue


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"text": " \n"}, "letters"),
        ({"text": "a" * 20_000}, "10000"),
        ({"height": 0}, "height"),
        ({"height": float("nan")}, "height"),
        ({"depth": -1}, "depth"),
        ({"direction": (0, 0, 0)}, "direction"),
        ({"up": (3, 0, 0)}, "up"),
        ({"font": "nowhere.ttf"}, "nowhere.ttf"),
        ({"font": "."}, "cannot be read"),
    ],
)
def test_wrong_arguments_are_named(arguments, words):
    with pytest.raises(vd.BodyError, match=words):
        vd.Text(**{"text": "Ab", "at": (0, 0, 0), "height": 9, **arguments})


def test_without_crossings_large_outlines_are_still_regions(monkeypatch):
    monkeypatch.setattr(outline_triangulation, "_MAX_PAIRS", 0)
    assert area_of(triangulate([SQUARE, SQUARE[::-1] / 2 + 2])) == pytest.approx(48)


@pytest.mark.parametrize(("align", "share"), [("center", 0.5), ("right", 1.0)])
def test_each_line_is_aligned_by_what_can_be_seen(align, share):
    at, lines = (5.0, 7.0, 9.0), ["i", " Ada ", "Lovelace"]
    for line in lines:
        low, high = vd.Text(line, at, 12, align=align).bounds()
        assert low[0] + share * (high[0] - low[0]) == pytest.approx(at[0])
    together = vd.Text("\n".join(lines), at, 12, align=align).bounds()
    widest = vd.Text(lines[-1], at, 12, align=align).bounds()
    assert [end[0] for end in together] == pytest.approx([end[0] for end in widest])


def test_an_empty_line_may_be_aligned():
    aligned = vd.Text("A\n\nB", (0, 0, 0), 12, align="center")
    assert vd.Text("A", (0, 0, 0), 12, align="center").bounds()[1][2] == aligned.bounds()[1][2]
