"""Elements of a COLLADA document: found by their names and ids, and the numbers in their texts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar
from xml.etree import ElementTree

from problems.base import FloatArray, InvalidProblem
from problems.geometry.mesh_files.faces import refused

LARGEST = 2**62  # whole number in a list
Element = ElementTree.Element
Number = TypeVar("Number", int, float)


class WithoutDoctype(ElementTree.TreeBuilder):
    """A builder of elements that refuses document types, whose entities may grow without end."""

    def doctype(self, *_: str | None) -> None:
        """Refuse a document type before an entity is read."""
        raise refused("a document type (DOCTYPE) is not read")


@dataclass(frozen=True, eq=False)
class Document:
    """A COLLADA document whose tags have lost their namespace.

    Attributes:
        root: of its elements.
        places: of vertices, (v, 3), by the sources that have been read.
    """

    root: Element
    places: dict[Element, FloatArray] = field(default_factory=dict)

    @classmethod
    def of(cls, content: bytes) -> Document:
        """The document in the content of a file.

        Raises:
            InvalidProblem: ``mesh`` is no XML, has a document type, or is no COLLADA.
        """
        try:
            root = ElementTree.fromstring(content, ElementTree.XMLParser(target=WithoutDoctype()))
        except InvalidProblem:
            raise
        except (ElementTree.ParseError, UnicodeError, LookupError, ValueError) as error:
            raise refused(f"it cannot be read: no XML: {' '.join(str(error).split())}") from error
        for element in root.iter():
            element.tag = element.tag.rpartition("}")[2]
        if root.tag != "COLLADA":
            raise refused(f"it cannot be read: its root is <{root.tag[:40]}>, not <COLLADA>")
        return cls(root)

    @cached_property
    def _by_id(self) -> dict[tuple[str, str], list[Element]]:
        """Elements by their tags and ids."""
        found: dict[tuple[str, str], list[Element]] = defaultdict(list)
        for element in self.root.iter():
            found[element.tag, element.get("id", "")].append(element)
        return found

    def target(self, element: Element, attribute: str, tag: str) -> Element:
        """The element of a tag to which an attribute of another refers.

        Raises:
            InvalidProblem: ``mesh`` has none of that id, or several, or it is in another file.
        """
        url = element.get(attribute, "")
        if not url.startswith("#"):
            raise refused(f"{shown(element)}: {attribute}={url[:60]!r} is in no place of this file")
        found = self._by_id.get((tag, url[1:]), [])
        if len(found) != 1:
            raise refused(
                f"{shown(element)}: {'no' if not found else 'more than one'} <{tag}> has the id {url[1:61]!r}"
            )
        return found[0]


def shown(element: Element) -> str:
    """An element in an error: its tag, and its id or name."""
    known = next((key for key in ("id", "name", "sid", "url") if key in element.attrib), None)
    if known is None:
        return f"<{element.tag[:40]}>"
    return f'<{element.tag[:40]} {known}="{" ".join(element.attrib[known].split())[:60]}">'


def only(element: Element, tag: str) -> Element:
    """The one child with a tag.

    Raises:
        InvalidProblem: there is none, or there are several.
    """
    found = element.findall(tag)
    if len(found) != 1:
        raise refused(f"{shown(element)}: one <{tag}> is needed, not {len(found)}")
    return found[0]


def whole(element: Element, attribute: str, otherwise: int | None = None) -> int:
    """The whole number, 0 at least, in an attribute.

    Args:
        element: that has it.
        attribute: its name.
        otherwise: its value where it is not stated.

    Raises:
        InvalidProblem: it is none, or is missing and has no other value.
    """
    text = element.get(attribute, "" if otherwise is None else str(otherwise)).strip()
    if not text.isdecimal() or len(text) > 15:
        raise refused(f"{shown(element)}: {attribute}={text[:20]!r} is no whole number")
    return int(text)


def numbers(element: Element, kind: Callable[[str], Number], count: int | None = None) -> list[Number]:
    """The numbers in the text of an element.

    Args:
        element: that has them.
        kind: ``int`` or ``float``.
        count: of the numbers, where it is known.

    Raises:
        InvalidProblem: something is no such number, or there are more or fewer.
    """
    text = element.text or ""
    try:
        found = [kind(word) for word in text.split()]
    except ValueError as error:
        raise refused(f"{shown(element)}: {' '.join(str(error).split())[:80]}") from error
    if "_" in text or len(element):
        raise refused(f"{shown(element)}: there is more in it than numbers")
    if kind is int and any(abs(number) > LARGEST for number in found):
        raise refused(f"{shown(element)}: a number in it is too large")
    if count is not None and len(found) != count:
        raise refused(f"{shown(element)}: {count} numbers are needed, not {len(found)}")
    return found


def known_only(element: Element, tags: set[str]) -> None:
    """Check that every child has one of the tags.

    Raises:
        InvalidProblem: one has not: it is not read.
    """
    for child in element:
        if child.tag not in tags:
            raise refused(f"{shown(element)}: {shown(child)} is not read")
