"""All fuzzers with new seeds for so many hours: ``python -m tests.fuzz --hours 8 --keep FOLDER``.

Certified verdicts on random statements are held against code of their own (``attacks``), by turns with hostile files
and arguments (``test_fuzz``). Whatever breaks is kept as a line of JSON with its seed, by which it is repeated:
``python -m tests.fuzz --attack "in space" --seed 123``. Ends with 1 where anything broke.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from fuzz.attacks import ATTACKS  # noqa: E402 (of the folder of tests)

HOSTILE = "files and arguments"
EXAMPLES = (20, 120)  # of each fuzzer in a round; their number is its seed
EVERY = 40  # attacks between two rounds of hostile files


def main() -> int:
    """Read the command line and attack until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--keep", type=Path, default=Path("fuzz-kept"), help="folder of what breaks")
    parser.add_argument("--attack", choices=[*ATTACKS, HOSTILE], help="this one alone")
    parser.add_argument("--seed", type=int, help="once, with this seed")
    options = parser.parse_args()
    names = [options.attack] if options.attack else [*ATTACKS, HOSTILE]
    if options.seed is not None:
        return sum(not attack(name, options.seed, options.keep, Counter()) for name in names)
    rng, counts, end = np.random.default_rng(), Counter[str](), time.monotonic() + 3600.0 * options.hours
    broken, number = 0, 0
    while time.monotonic() < end:
        number += 1
        for name in names:
            if name != HOSTILE or number % EVERY == 0 or options.attack:
                broken += not attack(name, int(rng.integers(1 << 31)), options.keep, counts)
        if number % 10 == 0:
            print(f"{dict(sorted(counts.items()))}, {broken} broken", flush=True)
    print(f"{dict(sorted(counts.items()))}, {broken} broken")
    return int(broken > 0)


def attack(name: str, seed: int, kept: Path, counts: Counter[str]) -> bool:
    """One attack; whether nothing broke."""
    try:
        held = hostile(seed) if name == HOSTILE else ATTACKS[name](np.random.default_rng(seed))
    except KeyboardInterrupt:
        raise
    except BaseException:
        kept.mkdir(parents=True, exist_ok=True)
        with (kept / "broken.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps({"attack": name, "seed": seed, "how": traceback.format_exc()}) + "\n")
        print(f"{name}, seed {seed}: {traceback.format_exc().strip().splitlines()[-1]}", flush=True)
        return False
    counts[f"{name}: attacks"] += 1
    counts[f"{name}: certified"] += held
    return True


def hostile(seed: int) -> int:
    """The fuzzers of files and arguments, with another number of examples, which is their seed."""
    examples = EXAMPLES[0] + seed % (EXAMPLES[1] - EXAMPLES[0])
    flags = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "-m"]
    command = [sys.executable, "-m", "pytest", str(HERE), *flags, "not slow"]
    environment = os.environ | {"TPBSO_FUZZ_EXAMPLES": str(examples)}
    done = subprocess.run(command, cwd=HERE.parent.parent, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-3000:]
    return 0


if __name__ == "__main__":
    sys.exit(main())
