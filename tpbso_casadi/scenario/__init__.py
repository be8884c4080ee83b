"""Scenarios: files that are validated key by key, and the built-in ones."""

from tpbso_casadi.scenario.cases import DEFAULT, TITLES, best_known, builtin
from tpbso_casadi.scenario.catalogues import (
    SOLVER_CATALOGUE,
    Catalogue,
    PluginError,
    current_name,
    find_objective,
    find_solver,
    subclass_of,
)
from tpbso_casadi.scenario.cell_robots import CellSection
from tpbso_casadi.scenario.cells import ENDS, Cell, criteria_of, judged_by_stage, stage_times, walked
from tpbso_casadi.scenario.constraints import HandSection
from tpbso_casadi.scenario.frames import FRAMES, FrameSection, KnownFrames, PoseInFrame
from tpbso_casadi.scenario.input_files import (
    InputFolder,
    is_folder,
    read_bytes,
    read_text,
    read_toml,
)
from tpbso_casadi.scenario.layout_section import ApartSection, FreeSection, LayoutSection
from tpbso_casadi.scenario.led_stages import LedStage, tool_frames
from tpbso_casadi.scenario.loading import load, load_all, overridden
from tpbso_casadi.scenario.model import FAMILIES, ModelSection, ObjectiveChoice, OwnObjectives, TaskSection
from tpbso_casadi.scenario.motion_files import READERS, pieces_in, read_recorded
from tpbso_casadi.scenario.moves import PointToPointTask
from tpbso_casadi.scenario.named_solvers import NamedSolver, each_of, named_solver
from tpbso_casadi.scenario.obstacle_section import ObstacleSection
from tpbso_casadi.scenario.obstacles import ShapeSection
from tpbso_casadi.scenario.packages import RobotFiles
from tpbso_casadi.scenario.path_tasks import FIELDS, Interpolation, PointsTask, pieces_table, points_table
from tpbso_casadi.scenario.places import AnyGoals, AnyPlace, AnyPlaces, SimulationSection
from tpbso_casadi.scenario.plugin_failures import plugin_failures_named
from tpbso_casadi.scenario.reading import parse_scenario, parse_stated, read_scenario, stated_scenario, with_files_read
from tpbso_casadi.scenario.recorded_rows import RecordedRows
from tpbso_casadi.scenario.recorded_tasks import motion_table, read_motion, rows_table
from tpbso_casadi.scenario.robots import (
    BESIDE,
    OF_THE_MODEL,
    AnyRobotTable,
    ArmSection,
    RobotSection,
    arm_table,
    settings_table,
)
from tpbso_casadi.scenario.row_tasks import LARGEST_ANGLE, OF_A_FILE, RowFileTask, read_joint_rows, reading_of
from tpbso_casadi.scenario.scenario import BuiltScene, Scenario
from tpbso_casadi.scenario.scene_files import read_scene
from tpbso_casadi.scenario.sequence import SequenceTask
from tpbso_casadi.scenario.solver_section import SolverSection
from tpbso_casadi.scenario.spatial_robots import SpatialRobotSection
from tpbso_casadi.scenario.stage_section import MovingStage, StageSection
from tpbso_casadi.scenario.tasks import STATED, TASK_CATALOGUE, task_tables
from tpbso_casadi.scenario.tracking_log import TrackingLog, read_tracking_log
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    LARGEST,
    LARGEST_SEED,
    LONGEST_WORD,
    MOST_EVALUATIONS,
    MOST_ITERATIONS,
    MOST_LINKS,
    MOST_MEMBERS,
    MOST_POLISH_STARTS,
    SMALLEST,
    Angle,
    PlanarPoint,
    Positive,
    ScenarioError,
    Section,
    SpacePoint,
    as_scenario_errors,
    named,
    path_of,
    plain,
    read_table,
    stated_values,
)

__all__ = [
    "ANGULAR",
    "BESIDE",
    "DEFAULT",
    "ENDS",
    "FAMILIES",
    "FIELDS",
    "FRAMES",
    "LARGEST",
    "LARGEST_ANGLE",
    "LARGEST_SEED",
    "LONGEST_WORD",
    "MOST_EVALUATIONS",
    "MOST_ITERATIONS",
    "MOST_LINKS",
    "MOST_MEMBERS",
    "MOST_POLISH_STARTS",
    "OF_A_FILE",
    "OF_THE_MODEL",
    "READERS",
    "SMALLEST",
    "SOLVER_CATALOGUE",
    "STATED",
    "TASK_CATALOGUE",
    "TITLES",
    "Angle",
    "AnyGoals",
    "AnyPlace",
    "AnyPlaces",
    "AnyRobotTable",
    "ApartSection",
    "ArmSection",
    "BuiltScene",
    "Catalogue",
    "Cell",
    "CellSection",
    "FrameSection",
    "FreeSection",
    "HandSection",
    "InputFolder",
    "Interpolation",
    "KnownFrames",
    "LayoutSection",
    "LedStage",
    "ModelSection",
    "MovingStage",
    "NamedSolver",
    "ObjectiveChoice",
    "ObstacleSection",
    "OwnObjectives",
    "PlanarPoint",
    "PluginError",
    "PointToPointTask",
    "PointsTask",
    "PoseInFrame",
    "Positive",
    "RecordedRows",
    "RobotFiles",
    "RobotSection",
    "RowFileTask",
    "Scenario",
    "ScenarioError",
    "Section",
    "SequenceTask",
    "ShapeSection",
    "SimulationSection",
    "SolverSection",
    "SpacePoint",
    "SpatialRobotSection",
    "StageSection",
    "TaskSection",
    "TrackingLog",
    "arm_table",
    "as_scenario_errors",
    "best_known",
    "builtin",
    "criteria_of",
    "current_name",
    "each_of",
    "find_objective",
    "find_solver",
    "is_folder",
    "judged_by_stage",
    "load",
    "load_all",
    "motion_table",
    "named",
    "named_solver",
    "overridden",
    "parse_scenario",
    "parse_stated",
    "path_of",
    "pieces_in",
    "pieces_table",
    "plain",
    "plugin_failures_named",
    "points_table",
    "read_bytes",
    "read_joint_rows",
    "read_motion",
    "read_recorded",
    "read_scenario",
    "read_scene",
    "read_table",
    "read_text",
    "read_toml",
    "read_tracking_log",
    "reading_of",
    "rows_table",
    "settings_table",
    "stage_times",
    "stated_scenario",
    "stated_values",
    "subclass_of",
    "task_tables",
    "tool_frames",
    "walked",
    "with_files_read",
]
