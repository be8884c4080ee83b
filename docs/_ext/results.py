"""The tables of ``benchmarks/results`` are pages of the manual, ``results/NAME``; links to the files lead there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.project import Project

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"


class ProjectWithResults(Project):
    """A project whose documents are those of its folder and the measured tables beside the benchmarks."""

    def discover(self, *arguments: Any, **options: Any) -> set[str]:
        """The names of all documents."""
        super().discover(*arguments, **options)
        for page in RESULTS.glob("*.md"):
            name = f"results/{page.stem}"
            self.docnames.add(name)
            self._docname_to_path[name] = page
            self._path_to_docname[page] = name
        return self.docnames


def add_results(app: Sphinx) -> None:
    """Let the documents of a site include the measured tables."""
    app.project.__class__ = ProjectWithResults


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the hook."""
    app.connect("builder-inited", add_results)
    return {"version": "1", "parallel_read_safe": True}
