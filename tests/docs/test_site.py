"""The manual is built without a warning, has every public name, fetches nothing and fits a telephone."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.browser import fetched, opened

import tpbso_casadi
from tpbso_casadi.cli.tpbso import COMMANDS
from tpbso_casadi.scenario.obstacles import SHAPES
from tpbso_casadi.scenario.tasks import TASKS

pytestmark = pytest.mark.process
REPOSITORY = Path(__file__).parents[2]
NARROW, WIDE = 420, 1280  # pixels
FRAMES = """<!doctype html><title>frames</title><body>{frames}<pre id="result"></pre><script>
addEventListener("load", () => {{
  const frames = [...document.querySelectorAll("iframe")].map(frame => {{
    const page = frame.contentDocument.documentElement;
    return [frame.getAttribute("src"), page.clientWidth, page.scrollWidth];
  }});
  document.getElementById("result").textContent = JSON.stringify(frames);
}});
</script>"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The manual, built strictly; notebooks are not executed. A warning fails the test."""
    pytest.importorskip("sphinx")
    folder = tmp_path_factory.mktemp("manual")
    options = ["-W", "--keep-going", "-q", "-d", str(folder / "doctrees"), "-D", "nb_execution_mode=off"]
    command = [sys.executable, "-m", "sphinx", *options, str(REPOSITORY / "docs"), str(folder / "site")]
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "site"


def names_in(inventory: Path) -> set[str]:
    """The Python names that other manuals could refer to."""
    from sphinx.util.inventory import InventoryFile  # noqa: PLC0415 (optional)

    loaded = InventoryFile.loads(inventory.read_bytes(), uri="")
    return {name for kind, entries in loaded.data.items() if kind.startswith("py:") for name in entries}


def test_it_is_built_strictly_with_every_public_name_and_fetches_nothing(site: Path) -> None:
    assert {f"tpbso_casadi.{name}" for name in tpbso_casadi.__all__} <= names_in(site / "objects.inv")
    commands = (site / "reference" / "commands.html").read_text()
    for command in COMMANDS:
        assert f'id="tpbso-{command}"' in commands
    scenario = (site / "reference" / "scenario.html").read_text()
    for word in {word for name in (*TASKS, *SHAPES) for word in name.split("/")}:
        assert f'"{word}"' in scenario.replace("&quot;", '"') or f">{word}<" in scenario, word
    for page in site.rglob("*.html"):
        outside = [address for address in loaded_by(page.read_text()) if re.match(r"(https?:)?//", address)]
        assert not outside, page


def loaded_by(text: str) -> list[str]:
    """What a page loads; where its links lead is the reader's choice."""
    return fetched(re.sub(r"<a\s[^>]*>", "", text))


@pytest.mark.slow
def test_a_browser_shows_it_without_complaints_and_without_sideways_scrolling(site: Path, tmp_path: Path) -> None:
    pages = sorted(str(page.relative_to(site)) for page in site.rglob("*.html"))
    assert len(pages) > 30
    frames = "".join(
        f'<iframe src="{page}" style="width:{width}px;height:800px;border:0"></iframe>'
        for page in pages
        for width in (NARROW, WIDE)
    )
    (site / "frames.html").write_text(FRAMES.format(frames=frames))
    text = opened(site / "frames.html", tmp_path / "profile", "--allow-file-access-from-files")
    result = re.search(r'<pre id="result">(.*?)</pre>', text)
    assert result is not None
    widths = json.loads(result[1])
    assert len(widths) == 2 * len(pages)
    assert [(page, width) for page, width, needed in widths if needed > width] == []
