"""A page as PDF: printed by a browser without a window, so that the PDF is the page."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from dftfs.errors import DftfsError
from dftfs.files import write_bytes

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "microsoft-edge")
PATIENCE_s = 120


def browser() -> str:
    """The program that prints.

    Raises
    ------
    DftfsError
        If none of `BROWSERS` is on the path.
    """
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        raise DftfsError(
            f"--pdf needs a browser that prints: one of {', '.join(BROWSERS)} on the path"
            " (on Debian: apt-get install chromium), or print the page from your own"
        )
    return found


def write_pdf(page: Path) -> Path:
    """Print an HTML file to a PDF of the same name beside it, whole or not at all.

    Raises
    ------
    DftfsError
        If there is no browser, it fails, or the file cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="dftfs-") as folder:
        made = Path(folder) / "page.pdf"
        command = [
            browser(), "--headless", "--no-pdf-header-footer", "--virtual-time-budget=10000",
            f"--user-data-dir={folder}", f"--print-to-pdf={made}", page.resolve().as_uri(),
        ]  # fmt: skip
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # which a browser refuses to root
        try:
            subprocess.run(command, capture_output=True, timeout=PATIENCE_s, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise DftfsError(f"{page}: {command[0]} did not print it: {error}") from None
        if not made.exists():
            raise DftfsError(f"{page}: {command[0]} did not print it")
        return write_bytes(page.with_suffix(".pdf"), made.read_bytes())
