"""A page printed to PDF by a browser that is on the machine."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from simulator.atomic_files import atomic_write
from simulator.errors import PhotositeError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge")
BROWSER_KEY = "PHOTOSITE_BROWSER"  # environment variable with the path of another one
MOST_S = 120.0


def find_browser() -> str | None:
    """Return the path of a browser of the Chromium family: that of $PHOTOSITE_BROWSER, or the first on the path; else None."""
    named = os.environ.get(BROWSER_KEY)
    return shutil.which(named) if named else next((found for name in BROWSERS if (found := shutil.which(name))), None)


def check_browser(path: str | os.PathLike[str]) -> str:
    """Return the browser that prints. path: of the PDF, for the message. Raises PhotositeError when there is none."""
    browser = find_browser()
    if browser is None:
        rule = (
            "needs Chromium, Chrome or Edge: install one (Debian and Ubuntu: apt install chromium), name one in "
            f"${BROWSER_KEY}, or open the HTML page and print it"
        )
        raise PhotositeError(rule, key="--pdf", value=os.fspath(path))
    return browser


def print_pdf(page: str, path: str | os.PathLike[str]) -> None:
    """Print a self-contained HTML page to a PDF file, without the network.

    Raises PhotositeError when there is no such browser, it fails, or the file cannot be written.
    """
    browser = check_browser(path)
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder, atomic_write(path) as temporary:
        source, printed = Path(folder) / "report.html", Path(folder) / "report.pdf"
        source.write_text(page, encoding="utf-8")
        options = ["--headless", "--disable-gpu", "--no-pdf-header-footer", "--host-resolver-rules=MAP * ~NOTFOUND"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            options.append("--no-sandbox")  # which Chromium does not start without as root
        command = [browser, *options, f"--user-data-dir={folder}/profile", f"--print-to-pdf={printed}", source.as_uri()]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=MOST_S, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise PhotositeError(
                f"{browser} did not print the page ({error}); print the HTML page by hand", file=path
            ) from None
        if not printed.is_file():
            told = (done.stderr.strip().splitlines() or ["no message"])[-1][:300]
            raise PhotositeError(f"{browser} did not print the page ({told}); print the HTML page by hand", file=path)
        shutil.copyfile(printed, temporary)
