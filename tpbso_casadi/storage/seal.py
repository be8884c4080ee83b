"""The seal of a stored result, which says what was edited.

They show accident and carelessness, not a forger, who can compute them anew.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from hashlib import sha256
from typing import Any

KEY = "seal"  # under which a document holds its digests
DIGITS = 12  # of a digest, hexadecimal


class BrokenSeal(ValueError):
    """A document that was changed; the message is one line that names the key."""


def sealed(document: dict[str, Any]) -> dict[str, Any]:
    """The document with its digests."""
    return {**document, KEY: _digests(document)}


def check_seal(document: dict[str, Any]) -> None:
    """Make sure that a document is what was sealed.

    Raises:
        BrokenSeal: it has no digests, or a value is not the one that was sealed.
    """
    stored = document.get(KEY)
    computed = _digests({key: value for key, value in document.items() if key != KEY})
    if not isinstance(stored, dict):
        raise BrokenSeal(f"{KEY}: missing key")
    for path in [*computed, *stored]:
        if path not in computed:
            raise BrokenSeal(f"{path}: missing key")
        if stored.get(path) != computed[path]:
            raise BrokenSeal(f"{path}: was changed after the file was written")


def _digests(document: dict[str, Any]) -> dict[str, str]:
    """By path, a digest of each value that holds no further keys."""
    return {path: _digest(path, value) for path, value in _leaves(document, "")}


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        entries: Any = value.items()
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        entries = enumerate(value)
    else:
        yield path, value
        return
    for key, item in entries:
        yield from _leaves(item, f"{path}.{key}" if path else str(key))


def _digest(path: str, value: Any) -> str:
    return sha256(json.dumps([path, value], sort_keys=True).encode()).hexdigest()[:DIGITS]
