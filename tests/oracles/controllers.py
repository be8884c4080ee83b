"""Readers of programs for controllers, written from the grammars that makers document; they share nothing with writers.

Each gives what a controller would do: postures in rad, in order, and outputs and waits between them.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

NUMBER = r"-?\d+(?:\.\d+)?"


class Read(NamedTuple):
    """What a program does.

    Attributes:
        rows: postures, (n, dof), rad.
        period: s from row to row; None where the controller decides.
        events: (number of rows before it, "output" or "wait", what).
    """

    rows: np.ndarray
    period: float | None
    events: list[tuple[int, str, Any]]


def numbers(text: str) -> list[float]:
    assert re.fullmatch(rf"\s*{NUMBER}(?:\s*,\s*{NUMBER})*\s*", text), text
    return [float(part) for part in text.split(",")]


def steps_of(lines: list[str], kinds: Mapping[str, str], ignored: str) -> list[tuple[str, tuple[str, ...]]]:
    """Lines by the patterns of statements; a line that fits none is an error of syntax."""
    found = []
    for line in lines:
        match = next(((kind, m.groups()) for kind, text in kinds.items() if (m := re.fullmatch(text, line))), None)
        assert match or re.fullmatch(ignored, line), f"no statement: {line!r}"
        found += [match] if match else []
    return found


def joined(steps: list[tuple[str, tuple[str, ...]]], row: Callable[..., list[float]], period: float | None) -> Read:
    rows: list[list[float]] = []
    events: list[tuple[int, str, Any]] = []
    for kind, groups in steps:
        if kind == "move":
            rows.append(row(*groups))
        elif kind == "output":
            events.append((len(rows), kind, (int(groups[0]), groups[1] in ("True", "TRUE", "ON", "1"))))
        elif kind == "wait":
            events.append((len(rows), kind, float(groups[0])))
    return Read(np.array(rows), period, events)


def urscript(files: Mapping[str, str]) -> Read:
    """URScript: ``def NAME():`` ... ``end``, one call a line, with a guard that compares the posture with the first."""
    (text,) = (text for name, text in files.items() if name.endswith(".script"))
    head, *lines, last, nothing = text.split("\n")
    assert re.fullmatch(r"def \w+\(\):", head) and last == "end" and nothing == ""
    assert sum(line.strip().split(" ")[0] in ("while", "if") for line in lines) == lines.count("  end") + lines.count(
        "    end"
    )
    call = rf"  servoj\(\[(.*)\], t=({NUMBER}), lookahead_time={NUMBER}, gain=\d+\)"
    kinds = {
        "move": rf"(?:{call}|  movej\(\[(.*)\], a=({NUMBER}), v=({NUMBER})(?:, r={NUMBER})?\))",
        "output": r"  set_digital_out\((\d+), (True|False)\)",
        "wait": rf"  sleep\(({NUMBER})\)",
        "start": r"  start = \[(.*)\]",
    }
    guard = r"\s*#.*|  (?:now|axis|while|end|stopj).*|    (?:if|axis|end).*|      (?:popup|halt).*"
    steps = steps_of(lines, kinds, guard)
    start = next(numbers(groups[0]) for kind, groups in steps if kind == "start")
    moves = [groups for kind, groups in steps if kind == "move"]
    periods = {float(groups[1]) for groups in moves if groups[1]}
    assert len(periods) <= 1
    read = joined(steps, lambda servo, _, move, *more: numbers(servo or move), next(iter(periods), None))
    if read.period is not None:
        assert np.array_equal(read.rows[0], start)
        return read
    return Read(np.array([start, *read.rows.tolist()]), None, [(row + 1, *event) for row, *event in read.events])


def krl(files: Mapping[str, str]) -> Read:
    """KRL: points of the ``.dat`` as E6AXIS aggregates, in degrees, and moves of the ``.src``."""
    data, source = (next(text for name, text in files.items() if name.endswith(end)) for end in (".dat", ".src"))
    assert data.startswith("&ACCESS RVP\n&REL 1\nDEFDAT ") and data.endswith("\nENDDAT\n")
    assert max(map(len, (data + source).split("\n"))) <= 140
    points = {}
    for name, body in re.findall(r"^DECL E6AXIS (\w+)=\{(.*)\}$", data, re.MULTILINE):
        axes = re.fullmatch(rf"A1 ({NUMBER})" + "".join(rf"(?:, A{n} ({NUMBER}))?" for n in range(2, 7)), body)
        assert axes, body
        points[name] = np.radians([float(value) for value in axes.groups() if value]).tolist()
    _, _, head, *lines, last, _ = source.split("\n")
    assert re.fullmatch(r"DEF \w+\(\)", head) and last == "END"
    kinds = {
        "move": r"S?PTP (\w+)(?: C_PTP)?",
        "output": r"\$OUT\[(\d+)\]=(TRUE|FALSE)",
        "wait": rf"WAIT SEC ({NUMBER})",
    }
    ignored = rf";.*|INT I|BAS\(#INITMOV,0\)|FOR I=1 TO 6|   \$VEL_AXIS\[I\]={NUMBER}|ENDFOR|\$APO\.CPTP=50"
    return joined(steps_of(lines, kinds, ignored), points.__getitem__, None)


def rapid(files: Mapping[str, str], outputs: Mapping[str, int]) -> Read:
    """RAPID: constants of type jointtarget, in degrees, and moves to them in one procedure; signals by their names."""
    (text,) = files.values()
    head, *lines, last, _ = text.split("\n")
    assert head.startswith("MODULE ") and last == "ENDMODULE"
    points = {}
    for name, own, more in re.findall(r"^  CONST jointtarget (\w+) := \[\[(.*?)\], \[(.*?)\]\];$", text, re.MULTILINE):
        assert len(numbers(own)) == 6 and more.split(", ") == ["9E9"] * 6
        points[name] = np.radians(numbers(own)).tolist()
    kinds = {
        "move": r"    MoveAbsJ (\w+), v1000, (?:fine|z10), \w+;",
        "set": r"    SetDO (\w+), ([01]);",
        "wait": rf"    WaitTime ({NUMBER});",
    }
    ignored = rf"\s*!.*|  CONST .*|  PROC \w+\(\)|  ENDPROC|    VelSet {NUMBER}, 5000;"
    steps = [
        ("output", (str(outputs[groups[0]]), groups[1])) if kind == "set" else (kind, groups)
        for kind, groups in steps_of(lines, kinds, ignored)
    ]
    return joined(steps, points.__getitem__, None)


def fanuc(files: Mapping[str, str]) -> Read:
    """LS: sections /PROG, /ATTR, /MN, /POS and /END; numbered lines; points in degrees of group 1."""
    text = next(text for name, text in files.items() if name.endswith(".LS"))
    found = re.fullmatch(r"/PROG  (\w+)\n/ATTR\n(.*?)/MN\n(.*)/POS\n(.*)/END\n", text, re.DOTALL)
    assert found
    points = {}
    for number, body in re.findall(r"P\[(\d+)\]\{\n   GP1:\n\tUF : \d+, UT : \d+,\n(.*?)\n\};", found[4], re.DOTALL):
        axes = re.findall(rf"\tJ(\d)= ({NUMBER}) deg", body)
        assert [int(axis) for axis, _ in axes] == [*range(1, len(axes) + 1)]
        points[number] = np.radians([float(value) for _, value in axes]).tolist()
    lines = found[3].splitlines()
    assert [int(line[:4]) for line in lines] == [*range(1, len(lines) + 1)]
    assert f"LINE_COUNT\t= {len(lines)};" in found[2]
    kinds = {
        "move": r"\s*\d+:J P\[(\d+)\] \d+% (?:FINE|CNT100) ;",
        "output": r"\s*\d+:DO\[(\d+)\]=(ON|OFF) ;",
        "wait": rf"\s*\d+:WAIT ({NUMBER})\(sec\) ;",
    }
    return joined(steps_of(lines, kinds, r"\s*\d+:!.{1,32} ;"), points.__getitem__, None)


def inform(files: Mapping[str, str], pulses: list[float]) -> Read:
    """INFORM: a job with pulses of C points and instructions between NOP and END."""
    text = next(text for name, text in files.items() if name.endswith(".JBI"))
    found = re.fullmatch(
        r"/JOB\n//NAME \w{1,32}\n//POS\n///NPOS (\d+),0,0,0,0,0\n///TOOL 0\n///POSTYPE PULSE\n///PULSE\n(.*)//INST\n"
        r"///DATE \d{4}/\d\d/\d\d \d\d:\d\d\n///ATTR SC,RW\n///GROUP1 RB1\nNOP\n(.*)END\n",
        text,
        re.DOTALL,
    )
    assert found
    points = {}
    for name, body in (line.split("=") for line in found[2].splitlines()):
        assert all(re.fullmatch(r"-?\d+", part) for part in body.split(","))
        points[name] = np.radians(np.array(numbers(body)) / pulses).tolist()
    assert len(points) == int(found[1])
    kinds = {
        "move": rf"MOVJ (C\d{{5}}) VJ={NUMBER} PL=[01]",
        "output": r"DOUT OT#\((\d+)\) (ON|OFF)",
        "wait": rf"TIMER T=({NUMBER})",
    }
    return joined(steps_of(found[3].splitlines(), kinds, r"'.{1,32}"), points.__getitem__, None)


def table(files: Mapping[str, str], in_degrees: bool) -> Read:
    """Rows in equal steps of time, and a column of signals."""
    (text,) = (text for name, text in files.items() if name.endswith(".csv"))
    header, *lines = csv.reader(text.splitlines())
    assert header[0] == "t" and header[-1] == "signal"
    values = np.array([[float(cell) for cell in line[:-1]] for line in lines])
    steps = np.diff(values[:, 0])
    np.testing.assert_allclose(steps, steps[0], atol=1e-6)
    events = [(row, "signal", line[-1]) for row, line in enumerate(lines) if line[-1]]
    rows = np.radians(values[:, 1:]) if in_degrees else values[:, 1:]
    return Read(rows, float(np.round(steps.mean(), 6)), events)
