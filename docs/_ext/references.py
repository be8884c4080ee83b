"""References to what is not documented here: types inside the packages and of other libraries stay plain text.

A reference that is neither documented nor the name of anything is still a warning, which ends a strict build.
"""

from __future__ import annotations

import re
import sys
from types import ModuleType
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.domains.python import PyObject
from sphinx.environment import BuildEnvironment
from sphinx.ext.napoleon.docstring import GoogleDocstring

from problems.base import FloatArray

OURS = ("problems", "solvers", "tpbso_casadi")
THEIRS = re.compile(r"(numpy|np|casadi|ca|scipy|pandas|pd|matplotlib|pathlib|collections|typing)\.")
NOT_LOADED = ("Figure", "DataFrame", "LiveView", "SuiteMotion")  # imported where they are used


def resolved(app: Sphinx, env: BuildEnvironment, node: pending_xref, content: nodes.Element) -> nodes.Node | None:
    """The one documented object of that name, plain text for another name that exists, None for one that does not."""
    if node.get("refdomain") != "py":
        return None
    target = str(node["reftarget"]).lstrip("~.")
    objects = env.domains.python_domain.objects
    named = {entry.node_id: entry for name, entry in objects.items() if name.rpartition(".")[2] == target}
    documented = [entry for entry in named.values() if entry.objtype in ("class", "exception", "function")]
    if len(documented) == 1:
        return _link(app, node, documented[0].docname, documented[0].node_id, content)
    return content if exists(target) else None


def _link(app: Sphinx, node: pending_xref, docname: str, anchor: str, content: nodes.Element) -> nodes.reference:
    uri = f"{app.builder.get_relative_uri(node['refdoc'], docname)}#{anchor}"
    return nodes.reference("", "", content, internal=True, refuri=uri, reftitle=node["reftarget"])


def exists(target: str) -> bool:
    """Whether a name is that of something inside the packages, or of another library."""
    if THEIRS.match(target) or target in NOT_LOADED:
        return True
    short = target.rpartition(".")[2]
    return any(
        short in vars(module) for name, module in list(sys.modules.items()) if name.partition(".")[0] in OURS and module
    )


def shown_as_stated(module: ModuleType) -> None:
    """Let a module of Sphinx show the types of arrays by their own name, not by what NumPy makes of it."""
    stringify = module.stringify_annotation

    def stated(annotation: Any, *arguments: Any, **options: Any) -> str:
        text: str = stringify(annotation, *arguments, **options)
        return "FloatArray" if annotation == FloatArray else text

    module.stringify_annotation = stated  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the resolver; of a property's docstring a colon is a colon, not the end of a type."""
    GoogleDocstring._consume_inline_attribute = lambda self: ("", self._dedent(self._consume_to_end()))
    for field in PyObject.doc_field_types:
        if field.name == "variable":
            field.label = "Attributes"
    for name, module in list(sys.modules.items()):
        if name.startswith("sphinx.") and hasattr(module, "stringify_annotation"):
            shown_as_stated(module)
    app.connect("missing-reference", resolved)
    return {"version": "1", "parallel_read_safe": True}
