"""YAML as ROS writes it; the library is loaded with this file."""

from __future__ import annotations

import math
import re
from typing import Any, ClassVar

import yaml

from problems.base import shown_value

NUMBERS = {
    "tag:yaml.org,2002:int": re.compile(r"[-+]?(0|[1-9][0-9]*)"),
    "tag:yaml.org,2002:float": re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"),
}  # of YAML 1.2, in which 1:30 is a word, 010 is ten and 1e-05 a number


class _SafeLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Plain data alone; no merge keys, which a short text can make endless; no key twice."""

    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag not in NUMBERS]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        if any(key.tag == "tag:yaml.org,2002:merge" for key, _ in node.value):
            raise yaml.constructor.ConstructorError(None, None, "merge keys (<<) are not read", node.start_mark)
        known = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in known:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {shown_value(key.value)} is there twice", key.start_mark
                )
            known.add(key.value)


for _tag, _pattern in NUMBERS.items():
    _SafeLoader.add_implicit_resolver(_tag, re.compile(f"({_pattern.pattern})$"), list("-+.0123456789"))


def _number_in_yaml(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int | float:
    """A number of YAML 1.2, one whose tag is stated too."""
    pattern = NUMBERS.get(node.tag, NUMBERS["tag:yaml.org,2002:float"])
    if not isinstance(node, yaml.ScalarNode) or pattern.fullmatch(node.value) is None:
        raise yaml.constructor.ConstructorError(None, None, "a tag says number, the text does not", node.start_mark)
    return int(node.value) if node.tag.endswith(":int") else float(node.value)


def _angle_in_yaml(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    """A number with the tag of xacro for its unit, in rad."""
    number = float(_number_in_yaml(loader, node))
    return math.radians(number) if node.tag == "!degrees" else number


for _tag in NUMBERS:
    _SafeLoader.add_constructor(_tag, _number_in_yaml)
for _tag in ("!degrees", "!radians"):
    _SafeLoader.add_constructor(_tag, _angle_in_yaml)


def yaml_document(text: str) -> Any:
    """The only document of a text, as plain data.

    Raises:
        ValueError: it is none, with the line and the reason.
    """
    try:
        documents = [each for each in yaml.load_all(text, Loader=_SafeLoader) if each is not None]
    except yaml.MarkedYAMLError as error:
        mark = "" if error.problem_mark is None else f" in line {error.problem_mark.line + 1}"
        raise ValueError(f"not YAML{mark}: {error.problem}") from error
    except (yaml.YAMLError, ValueError, RecursionError, TypeError, OverflowError) as error:
        raise ValueError(f"not YAML: {type(error).__name__}, {error}") from error
    if len(documents) != 1:
        raise ValueError(f"one document is needed, not {len(documents)}")
    return documents[0]
