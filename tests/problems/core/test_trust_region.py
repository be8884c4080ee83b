"""The rule by which a trust region follows the steps of a descent, by hand."""

from __future__ import annotations

import pytest

from problems.core import TrustRegion

REGION = TrustRegion(first=1.0, least=0.1, largest=3.0, growth=2.0, shrinkage=0.5, rejection=0.25, good=0.6, poor=0.2)


@pytest.mark.parametrize(("share", "size"), [(0.7, 2.0), (0.6, 1.0), (0.2, 1.0), (0.1, 0.5)])
def test_an_accepted_step_changes_the_size_by_what_came_true_of_its_promise(share: float, size: float) -> None:
    assert REGION.accepted(1.0, share) == size


def test_no_size_exceeds_the_largest() -> None:
    assert REGION.accepted(2.0, 1.0) == REGION.grown(2.0) == 3.0


def test_a_rejected_step_leaves_a_share_of_the_size() -> None:
    assert REGION.rejected(1.0) == 0.25
