"""A run that does not end costs its worker, not the campaign."""

from __future__ import annotations

import time
from concurrent.futures import BrokenExecutor

import pytest

from benchmarks.motion_bench_maker.run_limit import limited
from tpbso_casadi.campaign import processes


@pytest.mark.slow
def test_a_run_that_takes_too_long_is_ended() -> None:
    with limited(processes(1), 60.0).start() as executor:
        assert executor.submit(divmod, 7, 3).result() == (2, 1)
    with limited(processes(1), 0.1).start() as executor, pytest.raises(BrokenExecutor):
        executor.submit(time.sleep, 1000).result()
