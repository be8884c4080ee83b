"""``tp.simulate``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from problems import InvalidProblem, Trajectory
from problems.base import shown_value
from solvers import deferred_interrupt
from tpbso_casadi.facade.arguments import file_path, function
from tpbso_casadi.facade.showing import chosen
from tpbso_casadi.facade.statement import HasScenario, given_scenario
from tpbso_casadi.figures.palette import DEFAULT, FORMATS
from tpbso_casadi.replanning import Replanner
from tpbso_casadi.scenario import Scenario, ScenarioError, SimulationSection, as_scenario_errors, plugin_failures_named
from tpbso_casadi.simulation import (
    Replan,
    Simulation,
    SimulationRecord,
    SimulationResult,
    SimulationSetting,
    SummaryResult,
    write_simulation,
)
from tpbso_casadi.storage import OutputError, Writer

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class SimulationRun:
    """A simulation of the planner, judged with what obstacles really did; no robot was driven.

    Attributes:
        record: what was executed, and every answer of the planner.
        result: the content of ``result.json``.
    """

    record: SimulationRecord
    result: SimulationResult

    @property
    def scenario(self) -> Scenario:
        """The scenario as it was simulated, its [simulation] table and all postures complete."""
        return self.record.scenario

    @property
    def trajectory(self) -> Trajectory:
        """The motion that was executed."""
        return self.record.executed

    @property
    def duration(self) -> float:
        """The time that was simulated, s."""
        return self.record.duration

    @property
    def summary(self) -> SummaryResult:
        """The simulation in numbers: replans, deadlines, contacts, the closest approach."""
        return self.result.summary

    @property
    def good(self) -> bool:
        """Whether nothing was touched by the moving arm, nothing jumped, and every limit was kept, for all t."""
        return self.result.is_good

    @property
    def faults(self) -> list[str]:
        """Faults of the simulation, a few words each; none of a good one."""
        summary = self.summary
        faults = [f"{limit.name} not kept" for limit in self.result.limits if not limit.satisfied]
        if not summary.is_smooth:
            faults.insert(0, f"a jump of {max(summary.largest_jumps):.2g}")
        if not summary.is_safe:
            touched = f"{summary.collisions} collisions while moving, {summary.unproven} moves without a proof"
            faults.insert(0, touched)
        return faults

    def plot(self) -> Figure:
        """A figure of path, distances and answers over time, which a notebook shows."""
        from tpbso_casadi.figures.notebook import notebook_figure  # noqa: PLC0415 (matplotlib is slow to load)
        from tpbso_casadi.figures.simulation import simulation_figure  # noqa: PLC0415

        return notebook_figure(simulation_figure(self.record))

    def save(
        self, folder: str | Path, plots: bool = True, figures: Sequence[str] = DEFAULT, title: str | None = None
    ) -> Path:
        """Write ``result.json``, ``trajectory.csv``, ``replans.csv``, ``obstacles.csv``, a figure and a player.

        Args:
            folder: to write; what another run has left there is replaced.
            plots: whether to draw the figure and write the player.
            figures: formats of the figure: ``png``, ``pdf``, ``svg``.
            title: of the player; the name of the folder by default.

        Returns:
            The path of the folder.

        Raises:
            TypeError: the folder is no path.
            ValueError: there is no such format.
            OutputError: it cannot be written, or holds anything but a run.
        """
        place, formats = file_path("folder", folder), chosen("figures", figures, FORMATS)

        def draw(staged: Path) -> None:
            from tpbso_casadi.figures.simulation import draw_simulation  # noqa: PLC0415 (matplotlib is slow to load)

            draw_simulation(staged, self.record, formats)

        def player(staged: Path) -> None:
            from tpbso_casadi.animation.player import write_player  # noqa: PLC0415 (likewise)

            write_player(staged, place.name if title is None else title, self.record)

        views: list[Writer] = [draw, player] if plots else []
        with plugin_failures_named(self.scenario, OutputError), deferred_interrupt() as interruption:
            write_simulation(place, self.record, self.result, views, interruption)
        return place

    def __repr__(self) -> str:
        judged = "good" if self.good else "; ".join(self.faults)
        return f"<simulation: {self.duration:.4g} s, {self.summary.replans} replans, {judged}>"


def simulate(
    what: Scenario | HasScenario | str | Path,
    *,
    seconds: float | None = None,
    every: float | None = None,
    evaluations: int | None = None,
    within: float | None = None,
    seed: int | None = None,
    ready: Callable[[Scenario], object] = lambda scenario: None,
    told: Callable[[Replan], object] = lambda replan: None,
) -> SimulationRun:
    """Simulate how the planner drives an arm from goal to goal among obstacles that change course.

    At every tick it sees them anew, and has until the next one to answer. Simulated time waits for the planner; how
    often it was late is counted.

    Args:
        what: a scenario, with a [simulation] table or without; its file or name; or a plan.
        seconds: to simulate.
        every: time between two replans, s.
        evaluations: of each search.
        within: that an answer may take, s; the result then depends on the machine.
        seed: of obstacles and planner.
        ready: gets the complete scenario before the first tick.
        told: gets every answer of the planner.

    Returns:
        The simulation. After Ctrl-C too, once there is an answer.

    Raises:
        ScenarioError: it cannot be simulated; the message names the key.
        KeyboardInterrupt: Ctrl-C, before there was an answer.
    """
    function("ready", ready)
    function("told", told)
    given = given_scenario(what)
    if given is None:
        raise ScenarioError(
            f"what: a scenario, its file (.toml), its name or a plan is needed, not {shown_value(what)}"
        )
    stated = {"seconds": seconds, "every": every, "evaluations": evaluations, "within": within}
    if seed is not None or any(value is not None for value in stated.values()):
        given = simulation_scenario(given, seed=seed, **stated)
    with plugin_failures_named(given, OutputError), deferred_interrupt() as interruption:
        setting = interruption.breakable(partial(SimulationSetting.of, given))
        ready(setting.scenario)
        simulation = Simulation(setting, interruption.breakable(partial(_planner, setting)))
        record = simulation.run(interruption, told)
        return SimulationRun(record, SimulationResult.of(record))


def simulation_scenario(scenario: Scenario, seed: int | None, **settings: Any) -> Scenario:
    """The scenario with other keys of [simulation], those that are not None, and another seed.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    stated = {key: value for key, value in settings.items() if value is not None}
    with as_scenario_errors("simulation"):
        tables: dict[str, Any] = {"simulation": (scenario.simulation or SimulationSection()).with_keys(stated)}
    with as_scenario_errors("solver"):
        tables |= {} if seed is None else {"solver": scenario.solver.with_keys({"seed": seed})}
    return scenario.replaced(**tables)


def _planner(setting: SimulationSetting) -> Replanner:
    """The planner that is asked.

    Raises:
        ScenarioError: it does not plan such a task.
    """
    settings = setting.settings
    try:
        return Replanner(
            setting.scenario,
            every=settings.every,
            fail_safe_rate=settings.course_rate,
            evaluations=settings.evaluations,
            within=settings.within,
            seed=setting.scenario.solver.seed,
        )
    except InvalidProblem as error:
        raise ScenarioError(f"simulation.{error.field}: {error.reason}") from error
