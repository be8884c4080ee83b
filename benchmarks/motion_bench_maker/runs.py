"""Do what has not been done yet, each in a process of its own, and write down each answer when it is there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass

from benchmarks.motion_bench_maker.limited import NoResult, within
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.records import Record, Records
from benchmarks.motion_bench_maker.setting import Setting

START_SECONDS = 60.0  # for a process to start, and to judge what it found


@dataclass(frozen=True)
class Run:
    """A planner on a problem.

    Attributes:
        planner: its name in a record.
        seed: of the planner.
        setting: robot and limits.
        problem: what is to be planned.
        seconds: for planning.
        call: returns the record; its arguments are those above.
    """

    planner: str
    seed: int
    setting: Setting
    problem: MotionProblem
    seconds: float
    call: Callable[[str, Setting, MotionProblem, int, float], Record]

    @property
    def key(self) -> tuple[str, str, int, str]:
        """Of its record."""
        return self.problem.name, self.planner, self.seed, self.setting.digest(self.problem)

    def record(self) -> Record:
        """What the planner answers within twice its time; whatever goes wrong is an error in the record."""
        try:
            limit = 2.0 * self.seconds + START_SECONDS
            return within(limit, self.call, self.planner, self.setting, self.problem, self.seed, self.seconds)
        except NoResult as error:
            return Record(*self.key, self.setting.bound(self.problem), seconds=self.seconds, error=str(error))


def run_all(
    runs: Sequence[Run], records: Records, workers: int, progress: Callable[[Record], object] = lambda record: None
) -> None:
    """Do the runs that have no record yet.

    Args:
        runs: all of them.
        records: those that there are; new ones are added.
        workers: processes at a time.
        progress: called with each new record.
    """
    missing = set(records.missing(run.key for run in runs))
    with ThreadPoolExecutor(workers) as threads:
        futures = [threads.submit(run.record) for run in runs if run.key in missing]
        try:
            for future in as_completed(futures):
                records.add(future.result())
                progress(future.result())
        except BaseException:
            threads.shutdown(wait=False, cancel_futures=True)
            raise
