"""The documentation as HTML: without a warning, complete, and with no request to outside."""

import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from browser import NEEDED

import voxdisplay as vd
from voxdisplay.scene.objects import TYPES

ROOT = Path(__file__).parents[2]
# Tags whose address a browser loads by itself.
LOADED = {"img": "src", "script": "src", "link": "href", "iframe": "src", "source": "src"}

pytestmark = [
    pytest.mark.skipif(
        not all(map(find_spec, ("furo", "myst_parser", "numpydoc", "sphinx"))),
        reason="needs the extra docs",
    ),
    pytest.mark.skipif(not (ROOT / "docs/conf.py").exists(), reason="docs are not installed"),
]


class Page(HTMLParser):
    """Addresses of a page: those that are loaded, and those that links lead to."""

    def __init__(self, path):
        super().__init__()
        self.loaded, self.links, self.names = [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.names |= {values[key] for key in ("id", "name") if values.get(key)}
        if address := values.get(LOADED.get(tag)):
            self.loaded.append(address)
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder of the built site."""
    folder = tmp_path_factory.mktemp("site") / "html"
    # Python 3.12 and later warn of escape sequences when they compile packages that have such.
    warnings = ["-W", "ignore::SyntaxWarning"]
    command = [sys.executable, *warnings, "tools/docs.py", "--draft", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in sorted(site.rglob("*.html"))}


def test_nothing_is_loaded_from_outside(site, pages):
    assert len(pages) > len(vd.__all__)
    for path, page in pages.items():
        for address in page.loaded:
            parts = urlsplit(address)
            assert not parts.scheme or parts.scheme == "data", (path.name, address)
            assert not parts.netloc, (path.name, address)
            assert (path.parent / unquote(parts.path)).exists(), (path.name, address)
    for style in site.rglob("*.css"):
        text = style.read_text(encoding="utf-8")
        assert not re.search(r"@import|url\(\s*['\"]?(?:https?:)?//", text), style.name


def test_links_lead_to_pages_and_places_in_them(pages):
    for path, page in pages.items():
        for address in page.links:
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.exists(), (path.name, address)
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].names, (path.name, address)


def test_every_public_name_has_a_page(site):
    assert {path.stem for path in site.glob("api/*.html")} == {
        f"voxdisplay.{name}" for name in vd.__all__
    }


def test_every_type_and_example_has_its_picture(site, pages):
    objects, gallery = site / "objects.html", site / "gallery.html"
    shown = [Path(address).stem for address in pages[objects].loaded]
    assert set(TYPES) <= set(shown)
    drawn = [Path(address).name for address in pages[gallery].loaded]
    for example in (ROOT / "examples").glob("*.json"):
        moves = "duration" in json.loads(example.read_text(encoding="utf-8"))
        (picture,) = [name for name in drawn if name.startswith(example.stem)]
        assert picture.endswith(".gif" if moves else ".png")


def test_search_needs_no_server(site):
    """The index is a script, which browsers load from file://; nothing is fetched."""
    assert (site / "searchindex.js").read_text(encoding="utf-8").startswith("Search.setIndex(")
    search = (site / "search.html").read_text(encoding="utf-8")
    assert 'src="searchindex.js"' in search
    options = (site / "_static/documentation_options.js").read_text(encoding="utf-8")
    assert "SHOW_SEARCH_SUMMARY: false" in options


@NEEDED
def test_search_finds_pages_in_a_browser(site, tab):
    page = tab((site / "search.html").as_uri() + "?q=helix")
    page.wait("document.querySelectorAll('ul.search li').length > 2")
    found = page.run("[...document.querySelectorAll('ul.search a')].map(a => a.textContent)")
    assert "Helix" in found


@NEEDED
def test_pages_fit_a_telephone(site, tab):
    page = tab((site / "index.html").as_uri())
    page.size(390, 844, mobile=True)
    for path in [*sorted(site.glob("*.html")), site / "api/voxdisplay.Frame.html"]:
        page.go(path.as_uri())
        page.wait("document.readyState == 'complete'")
        assert page.run("document.documentElement.scrollWidth") <= 390, path.name


def test_the_rooms_are_drawn(site):
    drawing = (site / "_images/rooms.svg").read_text(encoding="utf-8")
    chart = (ROOT / "docs/architecture.md").read_text(encoding="utf-8").split("```mermaid")[1]
    rooms = re.findall(r"^ +(\w+)\[", chart.split("```")[0], re.MULTILINE)
    assert sorted(re.findall(r'class="n"[^>]*>(\w+)<', drawing)) == sorted(rooms)


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    tmp_path.joinpath("mine.txt").write_text("mine", encoding="utf-8")
    command = [sys.executable, "tools/docs.py", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "name another folder" in done.stderr
    assert tmp_path.joinpath("mine.txt").exists()
