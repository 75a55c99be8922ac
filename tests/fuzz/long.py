"""A long run of hostile input: `python tests/fuzz/long.py` (an hour or two), or part of it.

    python tests/fuzz/long.py --kind captures --count 4000 --seed 1
    python tests/fuzz/long.py --minutes 4 --resume fuzz.json     # again and again until it says done

Status 1 if anything was neither fine nor refused by name. `--package FOLDER` runs another version of reojax.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from itertools import islice
from pathlib import Path


def main() -> int:
    """Run all kinds, or one, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", action="append", help="kind of input; all by default")
    parser.add_argument("--count", type=int, help="how many of each kind")
    parser.add_argument("--share", type=float, default=1.0, help="part of the long run's counts")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=1e9, help="stop after that time")
    parser.add_argument("--resume", type=Path, help="file that what was done is kept in, to go on from")
    parser.add_argument("--like", type=Path, help="such a file of another version: without the inputs it left out")
    parser.add_argument("--slowest", type=int, help="longest time of one input [s]; default 60")
    parser.add_argument("--package", type=Path, help="folder that `reojax` is imported from")
    args = parser.parse_args()
    sys.path[0:1] = [*([str(args.package.resolve())] if args.package else []), str(Path(__file__).parents[1])]
    os.environ |= {"REOJAX_CACHE": "0", "JAX_PLATFORMS": "cpu"}
    os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false")
    import jax

    jax.config.update("jax_enable_x64", True)
    from fuzz import tally
    from fuzz.kinds import LONG, source
    from fuzz.tally import KINDS, Tally

    if args.slowest:
        tally.SLOWEST = args.slowest
    sys.stdout = os.fdopen(os.dup(1), "w")  # whatever somebody closes
    like = json.loads(args.like.read_text()) if args.like else {}

    kept = args.resume.resolve() if args.resume else None
    done = json.loads(kept.read_text()) if kept and kept.exists() else {}
    os.chdir(tempfile.mkdtemp())
    end = time.monotonic() + 60 * args.minutes
    for kind in args.kind or LONG:
        told, before = Tally(), done.setdefault(kind, {"seen": 0, "left out": [], "found": []})
        inputs, wanted = source(kind, args.seed), args.count or int(LONG[kind] * args.share)
        if inputs is None or before["seen"] >= wanted:
            continue
        absent = set(like.get(kind, before)["left out"])
        for index, (what, call) in islice(enumerate(inputs), before["seen"], wanted):
            before["seen"] += 1
            if call is None:
                before["left out"].append(index)
            elif index not in absent:
                told.judge(what, call)
            if index % 500 == 0:
                jax.clear_caches()
            if time.monotonic() > end:
                break
        for key, number in told.items():
            before[key] = before.get(key, 0) + number
        before["found"] += told.found
        if kept:
            kept.write_text(json.dumps(done, indent=1))
        if time.monotonic() > end:
            break
    print("| | tried |", " | ".join(KINDS), "|")
    for kind, row in done.items():
        print(f"| {kind} |", " | ".join(str(row.get(key, 0)) for key in ("tried", *KINDS)), "|")
    print(*sorted({text for row in done.values() for text in row["found"]}), sep="\n")
    print("done" if time.monotonic() < end else "time is over")
    return int(any(row["found"] for row in done.values()))


if __name__ == "__main__":
    sys.exit(main())
