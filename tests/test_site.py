"""The site of the pages: it builds without a warning, every public name has an entry, every link leads somewhere."""

import os
import subprocess
import sys
import zlib
from collections.abc import Iterator
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib import import_module
from pathlib import Path
from threading import Thread
from urllib.parse import unquote, urlsplit

import browser
import pytest
from once import made_once

pytest.importorskip("mkdocs", reason="mkdocs is not installed (extra docs)")
pytest.importorskip("mkdocstrings", reason="mkdocstrings is not installed (extra docs)")

pytestmark = pytest.mark.slow  # to build the site takes longer than most files of tests
ROOT = Path(__file__).parents[1]
SLOW_ms = 120_000
PACKAGES = ("hysteresis", "fem_models", "validation", "studies")
DOORS = ["notchbend"] + [
    ".".join(file.parent.relative_to(ROOT).parts)
    for package in PACKAGES
    for file in sorted((ROOT / package).rglob("__init__.py"))
    if "\n__all__ = " in file.read_text(encoding="utf-8")
]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make site` builds it; a warning fails."""

    def build(folder: Path) -> None:
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
        environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "WARNING" not in done.stderr

    return made_once(tmp_path_factory, "site", build)


@pytest.fixture(scope="module")
def entries(site: Path) -> set[str]:
    """Names with an entry: those of the inventory that other projects would link to (zlib after four lines)."""
    packed = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    return {line.split()[0] for line in zlib.decompress(packed).decode().splitlines()}


@pytest.mark.parametrize("door", DOORS)
def test_every_public_function_and_class_has_an_entry(entries: set[str], door: str) -> None:
    module = import_module(door)
    for name in module.__all__:
        thing = getattr(module, name)
        if callable(thing) and hasattr(thing, "__qualname__"):
            assert f"{thing.__module__}.{thing.__qualname__}" in entries, name


def test_docstrings_are_read_as_markdown(site: Path) -> None:
    """Examples are a block of code, and no role is left."""
    pages = {file.parent.name: file.read_text() for file in site.glob("reference/*/index.html")}
    assert set(pages) == {"notchbend", *PACKAGES}
    assert not any("<blockquote>" in page or ":func:" in page or ":class:" in page for page in pages.values())
    assert "&gt;&gt;&gt;" in pages["notchbend"]


class Page(HTMLParser):
    """The places of a page that can be linked to, what it links to, and what it loads."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {key: value or "" for key, value in attrs}
        self.names |= {found[key] for key in ("id", "name") if key in found}
        if "href" in found:
            (self.links if tag == "a" else self.loads).append(found["href"])
        if "src" in found:
            self.loads.append(found["src"])


def test_every_link_and_picture_of_the_site_is_there(site: Path) -> None:
    pages = {file.resolve(): Page(file) for file in site.rglob("*.html") if file.name != "404.html"}
    assert len(pages) > 40
    for file, page in pages.items():
        for target in page.links + page.loads:
            parts = urlsplit(target)
            if parts.scheme in ("http", "https") or target.startswith("data:"):
                assert target in page.links or target.startswith("data:"), f"{file}: loads {target}"
                continue
            there = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            there = there / "index.html" if there.is_dir() else there
            assert there.exists(), f"{file}: {target}"
            if parts.fragment and there in pages and parts.fragment != "__skip":
                assert unquote(parts.fragment) in pages[there].names, f"{file}: {target}"


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        """Say nothing on the terminal."""


@pytest.fixture
def address(site: Path) -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(site))) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_search_finds_a_function_without_the_network(address: str) -> None:
    with browser.chromium() as running:
        page = running.new_page()
        heard = browser.listen(page)
        page.goto(address)
        field = page.locator(".md-search__input").first
        field.click()
        # Material hears keys and the focus, not a value set by a script; before its index is ready it says so.
        page.locator(".md-search-result__meta").first.filter(has_text="Type to start searching").wait_for(
            timeout=SLOW_ms
        )
        field.press_sequentially("separate")
        page.locator(".md-search-result__item a[href*='reference/notchbend']").first.wait_for(timeout=SLOW_ms)
        assert (heard.errors, heard.hosts) == ([], [])
