"""The paper's Section IV in print: the numbers of its figures and tables, and its O()."""

from __future__ import annotations

from dataclasses import dataclass

from tpbso_casadi.scenario.cases.builtin import TITLES

FIGURES: dict[str, int] = {case: number for number, case in enumerate(TITLES, start=2)}  # in the paper's own order
POINT_TO_POINT = tuple(case for case in TITLES if case.startswith(("time", "rotation")))
TIME = tuple(case for case in TITLES if case.startswith("time"))
ROTATION = tuple(case for case in TITLES if case.startswith("rotation"))
OBSTACLES = tuple(case for case in TITLES if case.startswith("obstacle"))
PENTAGRAM = tuple(case for case in TITLES if case.startswith("pentagram"))
PATHS = tuple(case for case in TITLES if case.startswith(("pentagram", "closed-curve")))

NAMES = {"bso": "TPBSO", "pso": "PSO", "ga": "GA"}
RIVALS = ("pso", "ga")


@dataclass(frozen=True)
class Printed:
    """A mean and a standard deviation over 20 runs, s or rad."""

    mean: float
    std: float


TABLE_1: dict[str, dict[str, Printed]] = {
    "pentagram-time": {
        "ga": Printed(0.7982, 0.0757),
        "pso": Printed(0.7432, 0.0603),
        "bso": Printed(0.7139, 0.0420),
    },
    "pentagram-rotation": {
        "ga": Printed(25.4070, 1.3351),
        "pso": Printed(22.8910, 1.9832),
        "bso": Printed(22.3850, 1.0973),
    },
    "closed-curve-time": {
        "ga": Printed(1.4088, 0.1982),
        "pso": Printed(1.2569, 0.0370),
        "bso": Printed(1.1863, 0.0043),
    },
    "closed-curve-rotation": {
        "ga": Printed(24.3354, 0.2205),
        "pso": Printed(24.3594, 0.2050),
        "bso": Printed(24.1952, 0.2365),
    },
}


@dataclass(frozen=True)
class Order:
    """The growth that the paper prints in Table 2 or 3 for one experiment.

    Attributes:
        title: of the experiment.
        formula: as printed.
        exponents: by symbol, the power with which time or memory grows at most: n_i iterations, n_p population,
            n_d dimension, n_o points of the output, n_in of the input.
    """

    title: str
    formula: str
    exponents: dict[str, int]


TIME_ORDERS = {  # Table 2
    "algorithm": Order("in one iteration", "O(n_p n_d)", {"n_p": 1, "n_d": 1}),
    "point-to-point": Order("Experiment I", "O(n_i n_p n_d n_o)", {"n_i": 1, "n_p": 1, "n_d": 1, "n_o": 1}),
    "path": Order("Experiment II", "O(n_i n_p n_o)", {"n_i": 1, "n_p": 1, "n_d": 0, "n_o": 1}),
}
SPACE_ORDERS = {  # Table 3
    "algorithm": Order("the algorithm itself", "O(n_p n_d)", {"n_p": 1, "n_d": 1}),
    "point-to-point": Order("Experiment I", "O((n_p + n_o) n_d)", {"n_p": 1, "n_d": 1, "n_o": 1}),
    "path": Order("Experiment II", "O(n_o + n_in + n_p n_d)", {"n_p": 1, "n_d": 1, "n_o": 1, "n_in": 1}),
}
