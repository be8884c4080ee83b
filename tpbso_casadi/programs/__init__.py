"""Plans for other programs: messages, tables, programs for controllers; one exporter for each kind, by its name."""

from collections.abc import Mapping
from typing import Any

from problems.base import InvalidTable
from tpbso_casadi.programs.fanuc import Fanuc
from tpbso_casadi.programs.franka import Franka
from tpbso_casadi.programs.inform import Inform
from tpbso_casadi.programs.krl import Krl, Rsi
from tpbso_casadi.programs.points import Leg, PointExporter, Route
from tpbso_casadi.programs.program import Coding, ControllerExporter, Exporter, Program, Proof, Signal
from tpbso_casadi.programs.rapid import Egm, Rapid
from tpbso_casadi.programs.ros import RosJson, RosYaml
from tpbso_casadi.programs.streams import RowTable, Stream, StreamExporter
from tpbso_casadi.programs.tables import DEFAULT_RATE, HIGHEST_RATE, Csv, Npz
from tpbso_casadi.programs.urscript import MoveJ, ServoJ
from tpbso_casadi.scenario import Catalogue, PluginError, subclass_of
from tpbso_casadi.storage import OutputError

EXPORTERS: Catalogue[type[Exporter]] = Catalogue(
    kind="export",
    group="tpbso_casadi.programs",
    registry={
        "ros-json": RosJson,
        "ros-yaml": RosYaml,
        "csv": Csv,
        "npz": Npz,
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


NO_SETTINGS: Mapping[str, Any] = {}


def exporter_at(kind: str, rate: float | None) -> Exporter:
    """The exporter of a kind, at a rate in Hz where one is stated and the kind has one."""
    exporter = exporter_of(kind)
    return exporter if rate is None or "rate" not in exporter.schema() else exporter_of(kind, {"rate": rate})


def exporter_of(kind: str, settings: Mapping[str, Any] = NO_SETTINGS) -> Exporter:
    """The exporter of a kind with its settings, as plain data.

    Raises:
        OutputError: there is no such kind, or a setting is unknown or wrong; one line.
    """
    try:
        return EXPORTERS.find(kind).from_table(settings)
    except (PluginError, InvalidTable) as error:
        raise OutputError(str(error)) from error


__all__ = [
    "DEFAULT_RATE",
    "EXPORTERS",
    "HIGHEST_RATE",
    "Coding",
    "ControllerExporter",
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
    "exporter_at",
    "exporter_of",
]
