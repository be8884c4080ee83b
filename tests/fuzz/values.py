"""Values that files and command lines may hold but should not, and scenarios that hold one or two of them."""

from __future__ import annotations

from typing import Any

from fuzz.hostile import PLUGINS
from helpers.scenes import Raw, toml
from hypothesis import strategies as st

NUMBERS = ["1e308", "-1e308", "5e-324", "-5e-324", "1e12", "1e-12", "1e6", "1e-6", "inf", "-inf", "nan", "-0.0", "0.0"]
NUMBERS += ["0", "1", "2", "3", "-1", "7", "0.5", "0.1", "1.0", "3.14", "100", "1000", "10000", "50000"]
NUMBERS += [str(10**30), str(2**63), str(2**63 - 1), str(2**64), str(-(2**63)), "9" * 5000, "0x" + "f" * 5000]
WORDS = ["", "a", "\0", "\x1b[31m", "[red]", "[/]", "[/red]", "{}", "{a}", "%s", "$", "\n", "\u202e", "ä", "字", "🦾"]
WORDS += ["a" * 5000, "../" * 50 + "etc/shadow", "/dev/zero", "/dev/random", "/etc/passwd", ".", "..", "/", "~", "*"]
WORDS += ["time", "length", "bso", "paper", "reduced", "free", "up", "pentagram", "path", "point-to-point", "planar"]
WORDS += ["os:path", "sys:exit", ":", "a:b", ".a:b", "os:", "builtins:object", "builtins:type", "json.decoder:x.y"]
DATES = ["1979-05-27", "1979-05-27T07:32:00Z", "07:32:00", "1979-05-27T00:32:00.999999"]
OTHERS = ["true", "false", "[]", "{}", "[[]]", "[" * 3000 + "]" * 3000, "[" * 150 + "]" * 150, "{a={b={c=1}}}"]

numbers = (
    st.sampled_from(NUMBERS).map(Raw)
    | st.floats().map(lambda x: Raw(repr(x)))
    | st.integers().map(lambda n: Raw(str(n)))
)
words = st.sampled_from(WORDS + PLUGINS) | st.text(max_size=20)
scalars = numbers | words | st.sampled_from(DATES + OTHERS).map(Raw)
lists = st.lists(scalars, max_size=4) | st.tuples(numbers, st.integers(0, 3000)).map(lambda pair: [pair[0]] * pair[1])
values = scalars | lists | st.dictionaries(st.sampled_from(["a", "lambda_", "population", "c1"]), scalars, max_size=2)

ARM = {"link_lengths": [0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
MOVE = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.0], "objective": "length", "elbow": "free"}
OVAL = {"center": [0.8, 0.8], "semi_axes": [0.15, 0.25], "angle": 0.1}
POINT = {
    "arm": ARM | {"joint_limits": [[-3.0, 3.0]] * 3},
    "task": MOVE | {"segment_time": [0.1, 4.0]},
    "obstacles": [OVAL],
    "model": {"samples": 10, "formulation": "reduced", "limits": [], "knots": 5, "redundancy_values": 3},
    "solver": {"name": "bso", "seed": 1, "population": 10, "polish_starts": 0, "settings": {"c1": 1.0}},
}
ROWS = [[0.0, 1.2, 1.2, 0.0], [1.0, 1.2, 0.9, 0.5], [2.0, 1.4, 0.9, 1.0]]
CART = {"center": [1.9, 1.9], "semi_axes": [0.1, 0.1], "motion": "cart.csv"}
CRATE = {"shape": "box", "center": [0.0, 0.0], "size": [0.1, 0.1], "motion_rows": ROWS}
MOVING = POINT | {"obstacles": [OVAL | {"velocity": [-0.3, 0.1], "margin_rate": 0.01}, CRATE, CART]}
LINES = {"kind": "path", "accuracy": 0.05, "points": [[1.0, 0.0], [1.0, 0.5]], "closed": True, "count": 9}
SHAPED = {"kind": "path", "radius": 0.7, "accuracy": 0.1, "count": 12}
PATH = POINT | {"arm": ARM, "task": LINES | {"total_time": [0.1, 9.0]}, "obstacles": []}
STAR = PATH | {"task": SHAPED | {"shape": "pentagram", "center": [0.1, 0.0], "angle": 0.0}}
CURVE = PATH | {"task": SHAPED | {"shape": "closed-curve", "waves": 3, "depth": 0.2}}
ROBOT = {key: POINT[key] for key in ("task", "model", "solver")} | {"robot": {"model": "planar", "settings": ARM}}
SOLVERS = ["bso", "abso", "pso", "ga", "lshade", "scipy-de", "annealing", "cma", "pymoo", "ipopt"]


def places(content: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """The paths of all keys and list entries of plain data."""
    entries = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    found = [path] if path else []
    for key, entry in entries:
        found += places(entry, (*path, key))
    return found


def edited(content: Any, path: tuple[str | int, ...], value: Any, remove: bool = False) -> Any:
    """Plain data with another value at a path."""
    if not path:
        return value
    if isinstance(content, dict) and len(path) == 1:
        content = {path[0]: None} | content
    copy = dict(content) if isinstance(content, dict) else list(content)
    key = path[0]
    if remove and len(path) == 1:
        del copy[key]  # type: ignore[arg-type]
    else:
        copy[key] = edited(copy[key], path[1:], value, remove)  # type: ignore[index]
    return copy


@st.composite
def scenarios(draw: st.DrawFn) -> str:
    """The text of a scenario file with up to three odd values."""
    content = draw(st.sampled_from([POINT, MOVING, PATH, STAR, CURVE, ROBOT]))
    content = edited(content, ("solver", "name"), draw(st.sampled_from(SOLVERS)))
    if draw(st.booleans()):
        content = edited(content, ("solver", "settings"), {})
    for _ in range(draw(st.integers(0, 3))):
        path = draw(st.sampled_from(places(content)))
        content = edited(content, path, draw(values), draw(st.integers(0, 9)) == 0)
        if not isinstance(content, dict):
            break
    for _ in range(draw(st.integers(0, 1))):
        section = draw(st.sampled_from(["arm", "task", "model", "solver", "robot", "new"]))
        table = content.get(section)
        if isinstance(table, dict):
            key = draw(
                st.sampled_from(["time_limit", "iterations", "total_time", "knot_redundancy", "extra", "a" * 5000])
            )
            content = content | {section: table | {key: draw(values)}}
    return toml(**content)


def scaled(content: Any, factor: float) -> Any:
    """Plain data in another unit of length."""
    lengths = {"link_lengths", "start", "goal", "center", "semi_axes", "accuracy", "radius", "points", "velocity"}

    def times(value: Any) -> Any:
        return [times(entry) for entry in value] if isinstance(value, list) else value * factor

    if isinstance(content, list):
        return [scaled(entry, factor) for entry in content]
    if not isinstance(content, dict):
        return content
    return {key: times(entry) if key in lengths else scaled(entry, factor) for key, entry in content.items()}


@st.composite
def extremes(draw: st.DrawFn) -> str:
    """The text of a scenario file of an unusual size, and with up to three numbers that are allowed but unusual."""
    content = draw(st.sampled_from([POINT, MOVING, PATH, STAR, CURVE]))
    content = edited(content, ("solver", "name"), draw(st.sampled_from(SOLVERS)))
    content = edited(content, ("solver", "settings"), {})
    content = edited(content, ("model", "formulation"), draw(st.sampled_from(["paper", "reduced"])))
    content = edited(content, ("task", "objective"), draw(st.sampled_from(["time", "rotation", "length"])))
    content = scaled(content, 10.0 ** draw(st.integers(-11, 11) | st.just(0)))
    of_numbers = [path for path in places(content) if isinstance(_at(content, path), float)]
    for path in draw(st.lists(st.sampled_from(of_numbers), max_size=3)):
        factor = 10.0 ** draw(st.integers(-12, 12)) * draw(st.sampled_from([1.0, -1.0, 0.999999999]))
        content = edited(content, path, _at(content, path) * factor)
    return toml(**content)


def _at(content: Any, path: tuple[str | int, ...]) -> Any:
    for key in path:
        content = content[key]
    return content
