"""The report as PDF: printed by a headless Chromium if there is one, else by WeasyPrint."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
from pathlib import Path

from hysteresis.files import folder_beside
from hysteresis.own import marked_pdf
from studies.engines import MissingError

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
TIME_LIMIT_S = 120.0
_SCRIPT = re.compile(r"<script\b.*?</script>", re.DOTALL)


class PdfError(MissingError):
    """The PDF cannot be printed; one line with the reason."""


def browser() -> str | None:
    """Find a Chromium on the path; None if there is none."""
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


def has_weasyprint() -> bool:
    """Tell whether WeasyPrint is installed."""
    return importlib.util.find_spec("weasyprint") is not None


def write_pdf(page: Path) -> Path:
    """Print ``report.html`` to a PDF of the same stem in its folder; return the path.

    Raises
    ------
    PdfError
        One line: no program to print with, or it failed; an existing PDF is kept.
    """
    target, program = page.with_suffix(".pdf"), browser()
    try:
        with folder_beside(target) as folder:  # a Chromium in a container sees the page's folder, and no other
            part, still = folder.resolve() / "report.pdf", folder / "still.html"
            # only still images are printed: without scripts it is a few seconds faster
            still.write_text(_SCRIPT.sub("", page.read_text(encoding="utf-8")), encoding="utf-8")
            if program is not None:
                _by_browser(program, still, part)
            elif has_weasyprint():
                _by_weasyprint(still, part)
            else:
                names = ", ".join(BROWSERS)
                raise PdfError(f"--pdf: none of {names} on the path, and no WeasyPrint: expected one to print with")
            part.write_bytes(marked_pdf(part.read_bytes()))
            part.replace(target)
    except OSError as error:
        raise PdfError(f"{target}: {error.strerror}: expected a folder that can be written to") from None
    return target


def _by_browser(program: str, page: Path, part: Path) -> None:
    command = [
        program, "--headless", "--disable-gpu", "--no-pdf-header-footer", f"--user-data-dir={part.parent / 'profile'}",
        f"--print-to-pdf={part}", *(["--no-sandbox"] if _is_root() else []), page.resolve().as_uri(),
    ]  # fmt: skip
    try:
        done = subprocess.run(command, capture_output=True, timeout=TIME_LIMIT_S, check=False)
    except subprocess.TimeoutExpired:
        raise PdfError(f"{program}: no PDF within {TIME_LIMIT_S:g} s") from None
    if done.returncode or not part.exists():
        messages = done.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
        raise PdfError(f"{program}: exit code {done.returncode}: {messages[-1].strip()[:200]}")


def _is_root() -> bool:
    """Tell whether this is root, for whom Chromium has no sandbox; it opens only its own page here."""
    return hasattr(os, "geteuid") and os.geteuid() == 0


def _by_weasyprint(page: Path, part: Path) -> None:
    try:
        import weasyprint
    except OSError as error:  # it is installed without Pango
        raise PdfError(f"WeasyPrint: {' '.join(str(error).split())}: expected Pango on this machine") from None
    weasyprint.HTML(filename=str(page)).write_pdf(part)
