"""What every command refuses: one line that names the option or the file, status 2, and nothing is written."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.commands import module_of
from helpers.recorded import ARM, write_rows
from helpers.running import refusal
from helpers.scenes import SHORT_ARM, SWING, TURN, TWO_LINKS, toml
from helpers.urdf import ARM as URDF

OBSTACLE = '[[obstacles]]\nshape = "box"\ncenter = [0.6, 0.6]\nsize = [0.2, 0.2]\n'
MOTORS = ARM + "link_masses = [2.0, 1.0]\nmax_torque = [18.0, 6.0]\n"
RATES = {"samples": 20, "retime": False}


def scene(**tables: object) -> str:
    tables = {"model": RATES, "solver": {"evaluations": 200}} | tables
    return toml(arm=TWO_LINKS, task=SWING | {"elbow": "up"}, **tables)


LOGGED = "t,q1,m1\n" + "".join(f"{k},0.{k},0.{k}1\n" for k in range(1, 9))
FILES = {
    "mine.txt": "mine",
    "runs.sqlite": "no database " * 100,
    "arm.toml": ARM,
    "motors.toml": MOTORS,
    "empty.toml": "",
    "odd.toml": "not = = toml",
    "colour.toml": toml(arm=TWO_LINKS, task=SWING | {"colour": 3}),
    "path.csv": "q1,q2\n0,0.5\n0.6,0.9\n1,0.2\n1.5,0.4\n",
    "timed.toml": ARM + '[task]\nkind = "joint-path"\njoints = "path.csv"\n',
    "cell.toml": OBSTACLE,
    "touching.toml": 'may_touch = [["wall", "link 1"]]\n' + OBSTACLE,
    "banana.toml": '[[obstacles]]\nshape = "banana"\n',
    "two.toml": scene(),
    "paper.toml": scene(model=RATES | {"motion": "paper"}),
    "within.toml": scene(solver={"evaluations": 200, "within": 1.0}),
    "second.toml": toml(arm=SHORT_ARM, task=TURN, simulation={"second": 1.0}),
    "via.toml": toml(arm=SHORT_ARM, task=TURN | {"via": [[0.5, 0.5]]}),
    "turn.toml": toml(arm=SHORT_ARM, task=TURN),
    "arm.urdf": URDF,
    "spheres.toml": '[[spheres]]\nlink = "mast"\ncenter = [0.1, 0, 0.2]\nradius = 0.05\n',
    "one.csv": LOGGED,
    "header.csv": "t,q1,q2\n0,1,2\n",
    "back.csv": "t,q1,m1\n0,1,1\n0,2,1\n1,1,1\n2,1,1\n3,1,1\n",
    "odd.csv": "t,q1,m1\n0,1,1\n1_0,1,1\n",
    "short.csv": "t,q1,m1\n0,1,1\n1,1,1\n",
    "exact.csv": "t,q1,m1\n" + "".join(f"{k},0.{k},0.{k}\n" for k in range(1, 9)),
    "strange/mine.txt": "mine",
    "logged/coco": "",
    "fast-repaired": "mine",
    "others/certificates.csv": "t,q1,q2\n0,0,0\n",
}


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    for name in ("taken/summary.csv", "nothing", "many", "strange", "logged", "others"):
        Path(name).mkdir(parents=True)
    for name, text in FILES.items():
        Path(name).write_text(text)
    Path("binary.toml").write_bytes(b"\xff\xfe\x00binary")
    for name, seconds in (("good.csv", 2.0), ("fast.csv", 0.6), ("many/a.csv", 2.0), ("others/a.csv", 2.0)):
        write_rows(name, seconds)
    times = np.linspace(0.0, 2.0, 50)
    rows = np.column_stack([times, *[np.sin(times)] * 2, *[np.sin(times) + 0.001] * 2])
    np.savetxt("two.csv", rows, delimiter=",", header="t,q1,q2,m1,m2", comments="")


SPHERES = "function:sphere-2"
FRONT = "two.toml --objectives time,length --out front"
# What the line begins with, or, after three dots, what it holds.
REFUSED: dict[str, dict[str, str]] = {
    "solve": {
        "--iterations 0": "...greater than 0, not 0",
        "--time-limit nan": "...a finite number is needed",
        "--links 1": "...link",
        "--colour red": "...--colour",
        "--objective beauty": "...beauty",
        "--figures jpg": "...png, pdf, svg",
        "pentagram-time --links 2": "...at least 3 links",
        "missing.toml": "...No such file",
        "missing": "...--list",
        ".": "....",
        "--out mine.txt/out": "...is a file",
        "--out mine.txt": "...is a file",
        "--out .": ".: is the working folder, which cannot be replaced",
        "--out strange": "strange: holds mine.txt, which is not of a run",
        "--out out --animate out/films/arm.gif": "...arm.gif: a run folder holds no other folders",
        "--out /proc/nowhere": "...cannot be written",
        "colour.toml": "colour.toml: task.colour: unknown key",
        "odd.toml": "...odd.toml",
        "binary.toml": "...binary.toml",
        "empty.toml": "...empty.toml",
        "timed.toml --solver pso": "...solver: 'joint-path' is timed; there is nothing to search for",
    },
    "audit": {
        "time-2 --figures pdf": "--figures: an audit draws nothing by itself; say --plots DIR too",
        "nothing --plots drawn": "--plots: nothing is a run, whose figures are made with it; say a scenario",
    },
    "compare": {
        "": "the following arguments are required: SCENARIO",
        "nope": "nope: neither a file nor a built-in scenario",
        "no.toml": "no.toml: cannot be read",
        "time-2 --solvers bos": "time-2: bos: solver.name: no solver 'bos'; did you mean bso?",
        "time-2 --runs 0": "argument --runs: 0 is not positive",
        "time-2 --workers 2 --dask x:1": "argument --dask: not allowed with argument --workers",
        "time-2 --table runs.xlsx": "--table runs.xlsx: the name must end with .csv or .parquet",
        "time-2 --out mine.txt/below": "mine.txt/below: mine.txt is a file, not a folder",
        "time-2 --out .": "runs.sqlite: not a database",
        "time-2 --out taken": "taken/summary.csv: is a folder, and would be replaced",
        "time-2 --table runs/compare/summary.csv": "--table runs/compare/summary.csv: is a file that is",
        f"time-2 --runs {10**30}": "argument --runs: 1000000000000000000000000000000 is more than",
        f"time-2 --seed {2**63 - 1}": "seed: the last one would be larger than 9223372036854775807",
        f"time-2 --workers {10**9}": "--workers: more than ",
        "time-2 --dask nonsense": "--dask nonsense: is not an address like tcp://host:port",
        "time-2 --dask here:65536": "--dask here:65536: is not an address like tcp://host:port",
        "time-2 --dask carrier://here:1": "--dask carrier://here:1: carrier is none of tcp, tls, ws",
        "function:sphere": "function:sphere: 'sphere' is not FUNCTION-D or FUNCTION-D@N",
        "function:spere-2": "function:spere-2: no benchmark function 'spere'; did you mean sphere?",
        f"{SPHERES} {SPHERES}": f"{SPHERES}: is there twice",
        f"{SPHERES} time-2": "time-2: a scenario beside benchmark functions; compare each by itself",
        f"{SPHERES} --solvers ipopt": f"{SPHERES}: ipopt: IPOPT needs the derivatives",
        f"{SPHERES} --runs 100001": "runs: a campaign has at most 100000 in all",
        f"{SPHERES} --format csv": "...argument --format: csv is none of coco, ioh",
        f"{SPHERES} --out logged --format coco": "...logged/coco is a file, not a folder",
        " ".join(f"function:sphere-{d}" for d in range(1, 26)) + " --format coco": "--format coco: 25 cases where",
    },
    "pareto": {
        f"{FRONT} --objectives time": "...--objectives time: two different ones are needed",
        f"{FRONT} --objectives time,lenght": "...--objectives: no objective 'lenght'; did you mean length?",
        f"{FRONT} --points 1": "argument --points: 1 is less than 2",
        f"{FRONT} --method simplex": "argument --method: invalid choice: 'simplex'",
        f"{FRONT} --objectives rotation,length --method epsilon-constraint": "...needs time as one objective",
        f"{FRONT.replace('two', 'paper')} --method epsilon-constraint": "...needs time as one objective",
        f"{FRONT.replace('two', 'within')}": "...solver.within: a trade-off makes plans of so many evaluations",
        f"{FRONT} --out two.toml": "two.toml: two.toml is a file, not a folder",
    },
    "retime": {
        "path.csv": "path.csv: says nothing of a robot; say --robot ARM.toml",
        "path.csv --robot none.toml": "none.toml: cannot be read",
        "path.csv --robot path.csv": "path.csv: not TOML",
        "path.csv --robot empty.toml": "empty.toml: arm: missing key",
        "path.csv --robot arm.toml --blend -1": "...--blend: -1 is not 0 or a positive number",
        "path.csv --robot arm.toml --start-speed 9": "...task.start_speed: joint",
        "path.csv --robot arm.toml --out .": "...is the working folder",
        "nothing --out x": "nothing/result.json: cannot be read",
        "nothing --blend 0.1": "--blend: nothing is a run, whose path is complete",
        "path.csv --robot arm.toml --payload 1": "...payload",  # of links without masses
        "path.csv --robot motors.toml --payload -1": "...--payload: -1 is not 0 or a positive number",
        # level but for 0.5 rad: (1 kg 0.25 m + 5 kg 0.5 m) 9.81 m/s^2 cos(0.5)
        "path.csv --robot motors.toml --payload 5": "...joint 2 has to give 23.67 N m to hold the arm 0% along the",
    },
    "certify": {
        "good.csv --robot arm.toml --json --repair": "--repair: needs a run folder; say --out DIR too",
        "''": "argument TRAJECTORY|RUN_FOLDER|FOLDER: a path is needed, not ''",
        "good.csv": "good.csv: says nothing of a robot; say --robot panda, ARM.toml or ARM.urdf",
        "good.csv --robot none.toml": "none.toml: cannot be read: No such file or directory",
        "good.csv --robot arm.toml --scene none.toml": "none.toml: cannot be read: No such file",
        "good.csv --robot arm.toml --scene banana.toml": "banana.toml: obstacles.0.shape: input should be",
        "good.csv --robot arm.toml --scene touching.toml": "touching.toml: may_touch.0: nothing is called 'wall'",
        "good.csv --robot arm.toml --interpolation spline": "argument --interpolation: invalid choice",
        "good.csv --robot arm.toml --without x": "good.csv: task.without: 'x' is no limit; there are speed",
        "fast.csv --robot arm.toml --repair --out fast": "fast-repaired: ",
        "many": "many: says nothing of a robot; say --robot panda, ARM.toml or ARM.urdf",
        "nothing --robot arm.toml": "nothing: holds no result.json, and no *.csv, *.npz, *.json, *.yaml",
        "many --robot arm.toml --repair": "--repair: of one trajectory; a folder of them is judged alone",
        "many --robot arm.toml --out arm.toml": "arm.toml: arm.toml is a file, not a folder",
        "many --robot arm.toml --processes 0": "argument --processes: 0 is not positive",
        "others --robot arm.toml --out others": "others/certificates.csv: is no table of certificates; --out says",
    },
    "robots": {
        "show puma.urdf": "robot.urdf: puma.urdf: cannot be read: No such file or directory",
        "show .": "robot.moveit_config: .: no configuration of MoveIt: it has no folder config",
        "show arm.urdf --xacro-argument name": "--xacro-argument name: NAME=VALUE is needed",
        "show spheres.toml": "spheres.toml: urdf: no XML: syntax error: line 1, column 0",
        "show arm.urdf --tip-link hook": "arm.urdf: tip_link: no link 'hook' in the URDF; there are world",
        "show panda --base-link panda_link1": "panda: base_link: a robot that is built in has its own",
        "show panda --spheres spheres.toml": "spheres.toml: spheres: sphere 1: no link 'mast' in the chain",
        "show panda --spheres none.toml": "none.toml: cannot be read: No such file or directory",
        "show panda --figure panda.txt": "panda.txt: the name of a figure ends with .png, .pdf, .svg",
        "show panda --figure arm.urdf/panda.png": "arm.urdf/panda.png: cannot be written",
        "show": "the following arguments are required: NAME|FILE.urdf",
        "draw": "argument COMMAND: invalid choice: 'draw'",
        "spheres arm.urdf --package bars": "--package bars: NAME=FOLDER is needed",
    },
    "simulate": {
        "second.toml": "second.toml: simulation.second: unknown key; did you mean seconds?",
        "via.toml": "via.toml: task.via: is for a move from rest to rest",
        "turn.toml --out strange": "...holds mine.txt",  # the folder of something else
    },
    "suite": {
        "run --functions nope": "...no function or group 'nope'",
        "run --instances 16": "...no instance 16; they are 1 to 15",
        "list --suite arm-motions-3": "...invalid choice: 'arm-motions-3'",
        "run --solvers ipopt --functions spline-2": "...ipopt: IPOPT needs the derivatives",
        "run --budget 0": "...0 is not positive",
        "report nowhere": "...there are no runs; say --runs FILE",
        "report nowhere --runs none.csv": "...none.csv: No such file",
    },
    "tracking": {
        "two.csv one.csv": "...1 joints, two.csv has 2",
        "header.csv": "...header.csv: line 1: the header t,q1..qk,m1..mk is needed",
        "back.csv": "...back.csv: row 2: times have to increase",
        "odd.csv": "...odd.csv: line 3: a number is needed in column",
        "short.csv": "...2 rows; 5 at least are needed",
        "exact.csv": "...it is zero everywhere",
        "none.csv": "...none.csv",
    },
    "completion": {"cmd.exe": "argument SHELL: invalid choice: 'cmd.exe'"},
}


@pytest.mark.parametrize("command", REFUSED)
def test_one_line_names_what_is_wrong(command: str, capfd: pytest.CaptureFixture[str]) -> None:
    main: Callable[[list[str]], object] = module_of(command).main
    for arguments, expected in REFUSED[command].items():
        line = refusal(capfd, main, *shlex.split(arguments))
        assert expected.removeprefix("...") in line and (expected[:3] == "..." or line.startswith(expected)), line
    assert {name: Path(name).read_text() for name in FILES} == FILES
