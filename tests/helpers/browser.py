"""A page in a real browser without a window, where there is one."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

# A browser whose window nobody sees gives frames when it likes: here they come by the clock.
DRAWN_BY_CLOCK = """<!DOCTYPE html>
<script>window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 10);</script>"""


def after(script: str, text: str, folder: Path, *more: str) -> str:
    """The document of a page, drawn again after what a script did in it; see ``opened``.

    Args:
        script: run once the page's own have run.
        text: the page.
        folder: for the page and for what the browser keeps.
        more: flags of the browser.
    """
    page = folder / "page.html"
    page.write_text(f"{DRAWN_BY_CLOCK}{text}<script>{script}</script>", encoding="utf-8")
    return opened(page, folder / "profile", *more)


def opened(page: Path, profile: Path, *more: str) -> str:
    """The document of a page once its scripts have run; they must not have complained.

    Skips the test where there is no Chromium.

    Args:
        page: to open.
        profile: folder for what the browser keeps.
        more: flags of the browser.
    """
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if browser is None:
        pytest.skip("no Chromium here")
    own = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", "--virtual-time-budget=2000"]
    own += ["--enable-logging=stderr", "--window-size=1200,900", *more]
    command = [browser, *own, "--dump-dom", page.absolute().as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr, done.stderr
    return done.stdout


def fetched(text: str) -> list[str]:
    """What a page would fetch."""
    addresses = re.findall(r"""(?:src|href)=["']([^"']+)|url\(([^)]+)\)|@import\s+(\S+)""", text)
    flat = [address for group in addresses for address in group if address]
    return [address for address in flat if not address.startswith(("data:", "#"))]
