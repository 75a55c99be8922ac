"""Hostile input for some minutes, `python tests/fuzz/long.py --minutes 10 [--seed 1]`; status 1 if any was wrong."""

import argparse
import os
import random
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from reojax import session


def main() -> int:
    """Run every argument by every value once, then random ones of all kinds until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--random", action="store_true", help="leave out the round of every argument by every value")
    args = parser.parse_args()
    os.environ["REOJAX_CACHE"] = "0"
    session.compile_quickly()
    session.start()
    import hostile

    os.chdir(tempfile.mkdtemp())
    draw, end = random.Random(args.seed), time.monotonic() + 60 * args.minutes
    tallies = {kind: hostile.Tally() for kind in ("functions", "captures", "command lines")}
    for what, call in () if args.random else hostile.hostile_calls():
        tallies["functions"].judge(what, call)
        if time.monotonic() > end:
            break
    kinds = {
        "functions": hostile.hostile_calls(draw),
        "captures": hostile.hostile_files(draw),
        "command lines": hostile.hostile_lines(draw),
    }
    while time.monotonic() < end:
        for kind, source in kinds.items():
            for _ in range(20):
                what, call = next(source)
                tallies[kind].judge(str(what)[:200], call)
    print(f"seed {args.seed}\n{hostile.report(tallies)}")
    return int(any(tally["wrong"] for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
