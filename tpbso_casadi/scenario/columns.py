"""Columns of tables of joints: which holds the time, and which the position, velocity or acceleration of which joint.

Tables of ours name them themselves, recordings of a UR over RTDE and exports of PlotJuggler are recognised, and of any
other table a mapping says it: ``timestamp=t,actual_q_*=q*``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from problems.base import did_you_mean, shown_value
from tpbso_casadi.scenario.recorded_rows import MOST_MOTION_ROWS, BadRow
from tpbso_casadi.scenario.validation import MOST_LINKS

TIME_COLUMNS = ("t", "time")
TIME, POSITION, VELOCITY, ACCELERATION, MEASURED = "t", "q", "qd", "qdd", "m"
COLUMN = re.compile(r"(qdd|qd|q|m)([1-9][0-9]{0,3})")
TARGET = re.compile(r"(t)|(qdd|qd|q|m)(\*|[0-9]{1,4})")
SUFFIXES = {"_velocity": VELOCITY, "_acceleration": ACCELERATION}  # of a joint's name, in the names of columns
IGNORED = re.compile(r"(tau|effort)[1-9][0-9]*|x|y|z|qx|qy|qz|qw")  # columns of a run's table
SIGNAL = re.compile(r"(.*)/([^/]+)/(position|velocity|acceleration)")  # of PlotJuggler: topic, joint, quantity
SIGNALS = {"position": POSITION, "velocity": VELOCITY, "acceleration": ACCELERATION}
UR_ACTUAL = "timestamp=t,actual_q_*=q*,actual_qd_*=qd*"
UR_TARGET = "timestamp=t,target_q_*=q*,target_qd_*=qd*,target_qdd_*=qdd*"
UR_BOTH = "timestamp=t,target_q_*=q*,actual_q_*=m*"
CLOCK_OF_PLOTJUGGLER = "__time"
MOST_SHOWN = 8  # names of columns


class TableKind(NamedTuple):
    """A kind of table.

    Attributes:
        symbols: that are read of it.
        required: those of them that every joint has.
        header: what its first line has to be, for messages.
        timed: whether it needs a time.
        most: rows that are read.
    """

    symbols: tuple[str, ...]
    required: tuple[str, ...]
    header: str
    timed: bool = True
    most: int = MOST_MOTION_ROWS


STATES = (POSITION, VELOCITY, ACCELERATION)
MOTION = TableKind(STATES, (POSITION,), "the header t,q1,q2,... is needed, or t and the names of joints")
PATH = TableKind((POSITION,), (POSITION,), "the header q1,q2,... or t,q1,q2,... is needed", timed=False)
LOG = TableKind(
    (POSITION, MEASURED),
    (POSITION, MEASURED),
    "the header t,q1..qk,m1..mk is needed: commanded, then measured joints, rad or m",
    most=1_000_000,
)


class Column(NamedTuple):
    """A column that is read: its symbol, the joint that it is of, and its place from 0 on."""

    symbol: str
    joint: str
    place: int


@dataclass(frozen=True)
class Columns:
    """The columns of a table by what they hold.

    Attributes:
        joints: their names; numbers where the table has no names.
        places: of each symbol and joint, from 0 on.
        time: that of the time; None where there is none.
        absolute: whether times are those of some clock, whose zero says nothing of the motion.
    """

    joints: tuple[str, ...]
    places: dict[tuple[str, str], int]
    time: int | None
    absolute: bool = False

    @property
    def names(self) -> list[str]:
        """The names of joints, empty where they are numbered."""
        return [] if all(joint.isdigit() for joint in self.joints) else list(self.joints)

    def of(self, symbol: str) -> list[int]:
        """The column of each joint of a symbol; none where the table has none."""
        return [self.places[symbol, joint] for joint in self.joints if (symbol, joint) in self.places]


def columns_of(names: Sequence[str], line: int, mapping: str, kind: TableKind) -> Columns:
    """The columns of a table.

    Args:
        names: of its columns.
        line: that has them.
        mapping: of columns of the file to ours, as ``timestamp=t,actual_q_*=q*``; empty where they name themselves.
        kind: of the table.

    Raises:
        BadRow: the columns of a joint are missing, or those of the mapping.
    """
    where = f"line {line}: "
    if mapping:
        found = _mapped(names, mapping, all_needed=True)
    elif CLOCK_OF_PLOTJUGGLER in names:
        found = _signals(names)
    elif "timestamp" in names and (recorded := _recorded_by_ur(names, kind)):
        found = _mapped(names, recorded, all_needed=False)
    else:
        found = _own(names, where, kind)
    time = next((column.place for column in found if column.symbol == TIME), None)
    if time is None and kind.timed:
        raise BadRow(f"{where}{kind.header}")
    states = [column for column in found if column.symbol in kind.symbols]
    places = {(column.symbol, column.joint): column.place for column in states}
    absolute = time is not None and names[time] not in TIME_COLUMNS
    return Columns(_joints(places, where, kind), places, time, absolute)


def _joints(places: dict[tuple[str, str], int], where: str, kind: TableKind) -> tuple[str, ...]:
    """The joints of columns that hold all of them; numbers begin at 0 or 1 and leave none out."""
    symbols = {symbol for symbol, _ in places}
    if not symbols.issuperset(kind.required):
        raise BadRow(f"{where}{kind.header}")
    joints = [joint for symbol, joint in places if symbol == POSITION]
    if all(joint.isdigit() for joint in joints):
        first = 0 if "0" in joints else 1
        joints = [str(number) for number in range(first, first + len(joints))]
    if len(joints) > MOST_LINKS:
        raise BadRow(f"{where}{len(joints)} joints; at most {MOST_LINKS}")
    for symbol in (each for each in kind.symbols if each in symbols):
        missing = [joint for joint in joints if (symbol, joint) not in places]
        extra = [joint for each, joint in places if each == symbol and joint not in joints]
        if missing or extra:
            what = f"{symbol} of {(missing or extra)[0]} is {'missing' if missing else 'of none'}"
            raise BadRow(f"{where}the columns of all joints are needed; {what}")
    return tuple(joints)


def _own(names: Sequence[str], where: str, kind: TableKind) -> list[Column]:
    """Columns that name themselves: ``t,q1..qk,qd1..qdk,qdd1..qddk``, or the names of joints in place of q1..qk."""
    found = [Column(TIME, "", 0)] if names[0] in TIME_COLUMNS else []
    rest = names[len(found) :]
    numbered = bool(rest) and COLUMN.fullmatch(rest[0]) is not None
    if not rest or not (found or (numbered and not kind.timed)):
        raise BadRow(f"{where}{kind.header}")
    for place, name in enumerate(rest, start=len(found)):
        if numbered and IGNORED.fullmatch(name):
            continue
        symbol, joint = _numbered(name, where) if numbered else _named(name)
        if (symbol, joint) in [(known.symbol, known.joint) for known in found]:
            raise BadRow(f"{where}the column {shown_value(name)} is there twice")
        found.append(Column(symbol, joint, place))
    return found


def _numbered(name: str, where: str) -> tuple[str, str]:
    match = COLUMN.fullmatch(name)
    if match is None:
        raise BadRow(
            f"{where}{shown_value(name)} is no column of t,q1..qk,qd1..qdk,qdd1..qddk; columns says what it is"
        )
    return match[1], match[2]


def _named(name: str) -> tuple[str, str]:
    for suffix, symbol in SUFFIXES.items():
        if name.endswith(suffix):
            return symbol, name.removesuffix(suffix)
    return POSITION, name


def _recorded_by_ur(names: Sequence[str], kind: TableKind) -> str:
    """The mapping of a recording of a UR; empty for another table."""
    if MEASURED in kind.symbols:
        return UR_BOTH if {"target_q_0", "actual_q_0"} <= set(names) else ""
    return UR_ACTUAL if "actual_q_0" in names else UR_TARGET if "target_q_0" in names else ""


def _signals(names: Sequence[str]) -> list[Column]:
    """Columns of PlotJuggler: ``TOPIC/JOINT/position`` and so on, of one topic."""
    matches = [(place, match) for place, name in enumerate(names) if (match := SIGNAL.fullmatch(name))]
    topics = list(dict.fromkeys(match[1] for _, match in matches))
    if len(topics) != 1:
        found = f"positions of {len(topics)} topics ({_some(topics)})" if topics else "no column TOPIC/JOINT/position"
        raise BadRow(f"columns: {found}; say which are read: __time=t,{(topics or ['TOPIC'])[0]}/*/position=q*")
    clock = Column(TIME, "", names.index(CLOCK_OF_PLOTJUGGLER))
    return [clock, *(Column(SIGNALS[match[3]], match[2], place) for place, match in matches)]


def _mapped(names: Sequence[str], mapping: str, all_needed: bool) -> list[Column]:
    """The columns that a mapping names.

    Raises:
        BadRow: it is no mapping, names a column that is not there, or one for two things.
    """
    found: list[Column] = []
    for source, symbol, joint in parse_mapping(mapping):
        pattern = re.compile("(.+)".join(map(re.escape, source.split("*"))))
        matches = [(place, match) for place, name in enumerate(names) if (match := pattern.fullmatch(name))]
        if not matches and all_needed:
            reason = f"no column {shown_value(source)}; there are {_some(names)}{did_you_mean(source, names)}"
            raise BadRow(f"columns: {reason}")
        for place, match in matches:
            column = Column(symbol, match[1] if joint == "*" else joint, place)
            if any(place == known.place or column[:2] == known[:2] for known in found):
                what = f"{shown_value(names[place])} as {symbol}{column.joint}"
                raise BadRow(f"columns: {what}: the column, or what it is said to hold, is there twice")
            found.append(column)
    return found


def parse_mapping(mapping: str) -> Iterator[tuple[str, str, str]]:
    """The parts of a mapping: the column, the symbol of ours, and the joint or ``*``.

    Raises:
        BadRow: it is none.
    """
    for part in mapping.split(","):
        source, _, target = (text.strip() for text in part.rpartition("="))
        match = TARGET.fullmatch(target)
        if match is None or not source or source.count("*") != (match[3] == "*"):
            needed = "COLUMN=t, COLUMN=q1 or COLUMN_*=q* is needed (qd, qdd, or m of measured joints, as q)"
            raise BadRow(f"columns: {needed}, not {shown_value(part.strip())}")
        yield source, match[1] or match[2], match[3] or ""


def _some(names: Sequence[str]) -> str:
    listed = ", ".join(shown_value(name) for name in names[:MOST_SHOWN])
    return listed + (f" and {len(names) - MOST_SHOWN} more" if len(names) > MOST_SHOWN else "")
