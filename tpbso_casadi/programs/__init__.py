"""Programs for controllers: one exporter for each kind, found by its name."""

from collections.abc import Mapping
from typing import Any

from problems.base import InvalidTable
from tpbso_casadi.programs.fanuc import Fanuc
from tpbso_casadi.programs.franka import Franka
from tpbso_casadi.programs.inform import Inform
from tpbso_casadi.programs.krl import Krl, Rsi
from tpbso_casadi.programs.points import Leg, PointExporter, Route
from tpbso_casadi.programs.program import Coding, Exporter, Program, Proof, Signal
from tpbso_casadi.programs.rapid import Egm, Rapid
from tpbso_casadi.programs.streams import RowTable, Stream, StreamExporter
from tpbso_casadi.programs.urscript import MoveJ, ServoJ
from tpbso_casadi.scenario import Catalogue, PluginError, subclass_of
from tpbso_casadi.storage import OutputError

EXPORTERS: Catalogue[type[Exporter]] = Catalogue(
    kind="program",
    group="tpbso_casadi.programs",
    registry={
        "urscript": ServoJ,
        "urscript-movej": MoveJ,
        "krl": Krl,
        "rsi": Rsi,
        "rapid": Rapid,
        "egm": Egm,
        "fanuc": Fanuc,
        "franka": Franka,
        "inform": Inform,
    },
    accepts=subclass_of(Exporter),
    requirement="a subclass of tpbso_casadi.programs.Exporter",
)


def exporter_of(kind: str, settings: Mapping[str, Any]) -> Exporter:
    """The exporter of a kind with its settings, as plain data.

    Raises:
        OutputError: there is no such kind, or a setting is unknown or wrong; one line.
    """
    try:
        return EXPORTERS.find(kind).from_table(settings)
    except (PluginError, InvalidTable) as error:
        raise OutputError(str(error)) from error


__all__ = [
    "EXPORTERS",
    "Coding",
    "Exporter",
    "Leg",
    "PointExporter",
    "Program",
    "Proof",
    "Route",
    "RowTable",
    "Signal",
    "Stream",
    "StreamExporter",
    "exporter_of",
]
