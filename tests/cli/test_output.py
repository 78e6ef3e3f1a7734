"""Notes and progress bars of commands, on stderr, besides their results."""

import io

from voxdisplay.cli.output import plural, progress_bar


class Screen(io.StringIO):
    """A terminal that remembers all that was written to it."""

    def isatty(self):
        return True


def test_a_bar_is_shown_once_there_is_more_than_one_step(monkeypatch):
    screen = Screen()
    monkeypatch.setattr("sys.stderr", screen)  # here: between set-up and test it is exchanged
    with progress_bar("sending") as update:
        update(0, 1)
        update(1, 1)
        assert screen.getvalue() == ""
        update(1, 4)
        update(2, 8)
    text = screen.getvalue()
    assert "sending" in text
    assert "25%" in text
    assert text.endswith("\n")


def test_no_bar_where_nobody_looks(monkeypatch):
    nobody = io.StringIO()
    monkeypatch.setattr("sys.stderr", nobody)
    with progress_bar("sending") as update:
        assert update is None
    assert nobody.getvalue() == ""


def test_counts_have_their_nouns():
    assert [plural(count, "voxel") for count in (0, 1, 12_345)] == [
        "0 voxels",
        "1 voxel",
        "12 345 voxels",
    ]
