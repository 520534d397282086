"""A headless Chromium for the tests of pages: what is said on its console and asked from the network is kept."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from queue import Queue
from urllib.parse import urlsplit

import matplotlib.image
import numpy as np
import pytest

from studies.report.pdf import browser

# no graphics card is needed: SwiftShader draws WebGL on the processor
OPTIONS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@dataclass
class Heard:
    """Errors of a page and its console, and hosts other than this machine that it asked."""

    errors: list[str] = field(default_factory=list)
    hosts: list[str] = field(default_factory=list)


def require_browser() -> str:
    """Path of the Chromium; skips where there is none."""
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = browser()
    if found is None:
        pytest.skip("no Chromium on the path")
    return found


@contextmanager
def chromium() -> Iterator:
    """A running browser of playwright."""
    program = require_browser()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        running = play.chromium.launch(executable_path=program, args=list(OPTIONS))
        try:
            yield running
        finally:
            running.close()


@contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """The address that `notchbend app` prints, which is served until the block ends."""
    command = "from studies.commands import main; main()"
    app = subprocess.Popen(
        [sys.executable, "-c", command, "app", "--port", "0", "--no-browser", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    line = Queue()
    threading.Thread(target=lambda: line.put(app.stdout.readline()), daemon=True).start()
    try:
        said = line.get(timeout=60)
        assert "http://127.0.0.1:" in said
        yield said.split()[-1]
    finally:
        app.terminate()
        app.communicate(timeout=20)


def listen(page) -> Heard:
    """Keep what a page says from now on."""
    heard = Heard()
    page.on("console", lambda said: heard.errors.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: heard.errors.append(str(error)))

    def asked(request) -> None:
        address = urlsplit(request.url)
        if address.scheme not in ("data", "blob", "file") and address.hostname != "127.0.0.1":
            heard.hosts.append(request.url)

    page.on("request", asked)
    return heard


def keep_picture(shown, name: str, **options: bool) -> None:
    """Keep a picture of a page or a part for who looks at it: no test reads it, and a long page takes seconds to draw.

    In the folder NOTCHBEND_SCREENSHOTS, which CI keeps; none is drawn where it is not set.
    """
    if folder := os.environ.get("NOTCHBEND_SCREENSHOTS"):
        shown.screenshot(path=Path(folder) / f"{name}.png", **options)


def ink(png: bytes, *, height: float = 1.0, width: float = 1.0) -> float:
    """Share of the pixels that differ from the colour most of the border has, in a part from the top left."""
    picture = _part(png, height, width)
    border = np.concatenate([picture[0], picture[:, 0]])
    colours, counts = np.unique(border, axis=0, return_counts=True)
    return float((np.abs(picture - colours[counts.argmax()]) > 0.05).any(axis=2).mean())


def tints(png: bytes, *, height: float = 1.0, width: float = 1.0) -> int:
    """Number of different colours in a part of a picture, in steps of 1/16."""
    return len(np.unique((_part(png, height, width) * 16).astype(int).reshape(-1, 3), axis=0))


def _part(png: bytes, height: float, width: float) -> np.ndarray:
    picture = matplotlib.image.imread(BytesIO(png))[:, :, :3]
    return picture[: int(height * len(picture)), : int(width * picture.shape[1])]
