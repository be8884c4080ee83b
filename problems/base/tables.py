"""Tables of files as frozen objects: keys with types and bounds, read from plain data and written as plain data.

A subclass of :class:`Table` states its keys as annotated fields, as a dataclass does. What is wrong is said in one
line, with the path of the key.
"""

from __future__ import annotations

import json
from collections.abc import Container, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from typing import Any, ClassVar, Self, dataclass_transform

from problems.base.readers import Key, check_keys, keys_of_fields, reader
from problems.base.refusals import at


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
class Table:
    """A table of a file: a frozen dataclass that is read from plain data, and is written as such.

    Attributes:
        stated_keys: names of the keys that were stated, rather than left out.
    """

    stated_keys: ClassVar[frozenset[str]]  # of an object, set where it is made

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        dataclass(frozen=True, kw_only=True)(cls)

    def __new__(cls, **values: Any) -> Self:
        made = super().__new__(cls)
        object.__setattr__(made, "stated_keys", frozenset(values))
        return made

    def __post_init__(self) -> None:
        known = self.schema()
        for name in filter(self.stated_keys.__contains__, known):  # in the order of the keys
            with at(name):
                object.__setattr__(self, name, reader(known[name].hint)(getattr(self, name)))
        with at():
            self.check()

    def check(self) -> None:
        """Check that the keys fit each other; subclasses say how.

        Raises:
            InvalidTable: they do not.
        """

    @classmethod
    def schema(cls) -> dict[str, Key]:
        """The keys of the table, by their names."""
        return keys_of_fields(cls)

    @classmethod
    def from_table(cls, content: Any) -> Self:
        """The table of plain data.

        Args:
            content: a mapping of keys, as TOML and JSON have them; a table of this class is returned as it is.

        Raises:
            InvalidTable: naming the first wrong key.
        """
        if isinstance(content, cls):
            return content
        check_keys(content, cls.schema())
        return cls(**content)

    @classmethod
    def like(cls, thing: object) -> Self:
        """The table of an object that has an attribute for each key.

        Raises:
            InvalidTable: an attribute is of another type than the key.
        """
        return cls(**{name: getattr(thing, name) for name in cls.schema()})

    def table(self) -> dict[str, Any]:
        """The keys and their values as plain data."""
        return {name: plain_value(getattr(self, name)) for name in self.schema()}

    def part(self, names: Container[str]) -> dict[str, Any]:
        """Some of the keys and their values as plain data."""
        return {name: value for name, value in self.table().items() if name in names}

    def as_text(self) -> str:
        """The table as JSON in one line."""
        return json.dumps(self.table())

    def values(self) -> dict[str, Any]:
        """The values of the keys as they are, by their names."""
        return {name: getattr(self, name) for name in self.schema()}

    def with_keys(self, content: Mapping[str, Any]) -> Self:
        """The table with some keys stated anew, all of them checked as those of a file.

        Args:
            content: values of keys, as plain data or as they are.

        Raises:
            InvalidTable: naming the first wrong key.
        """
        return self.from_table({name: getattr(self, name) for name in self.stated_keys} | dict(content))

    def replaced(self, **values: Any) -> Self:
        """The table with other values of some keys, which are stated from then on; the values are not checked."""
        made = self.filled_in(**values)
        object.__setattr__(made, "stated_keys", self.stated_keys | values.keys())
        return made

    def filled_in(self, **values: Any) -> Self:
        """The table with values of keys that nobody stated, or that stand elsewhere; the values are not checked."""
        made = object.__new__(type(self))  # without what was computed of the other keys
        for name, value in {**self.values(), **values, "stated_keys": self.stated_keys}.items():
            object.__setattr__(made, name, value)
        return made


def plain_value(value: Any) -> Any:
    """A value as plain data: tables and dataclasses as mappings, tuples as lists, members of enumerations as values."""
    if type(value) is float:  # most of a long document
        return value
    if hasattr(value, "table"):  # what states itself
        return value.table()
    if isinstance(value, Mapping):
        return {name: plain_value(entry) for name, entry in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: plain_value(getattr(value, each.name)) for each in fields(value) if each.init}
    if isinstance(value, Enum):
        return value.value
    return [plain_value(entry) for entry in value] if isinstance(value, list | tuple) else value
