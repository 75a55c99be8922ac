"""Ctrl-C at random moments of long commands: one line, status 130, nothing half written.

    python tests/fuzz/interrupts.py --times 20

Status 1 if any command ended otherwise. A command that is done before its Ctrl-C counts as done.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

CAPTURE = Path(__file__).parents[2] / "docs" / "synthetic_capture.csv"
COMMANDS = {
    "sweep": ["sweep", "twist=0:270:200", "bend=0:120:100", "--store", "store", "--chunk-size", "500"],
    "plan": ["plan", "--target", "rotvec", "100", "50", "-70", "--max-manoeuvres", "6", "--csv", "plan.csv"],
    "compare --calibrate": ["compare", str(CAPTURE), "--calibrate", "end_inertia,rotor_inertia", "--out", "c.png"],
}
"""Some seconds each."""


def interrupted(command: list[str], after: float, folder: Path) -> str:
    """Run a command, interrupt it after a time, and say what is wrong: "" for nothing, "done" if it was."""
    environment = os.environ | {"REOJAX_CACHE": "0", "JAX_PLATFORMS": "cpu"}
    process = subprocess.Popen(
        [sys.executable, "-m", "reojax", *command],
        cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    try:
        _, said = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        return "it went on for a minute"
    left = [file.name for file in folder.rglob(".reojax-*")]
    if process.returncode == 0:
        return "done"
    last = said.replace("\r", "\n").rstrip("\n").rpartition("\n")[2]
    if process.returncode == -signal.SIGINT and not said:
        return "before Python had begun"  # nobody's code can tell of that
    if process.returncode != 130 or not last.startswith("reojax: interrupted") or "Traceback" in said:
        return f"status {process.returncode}: {said[-300:]}"
    return f"left {left}" if left else ""


def main() -> int:
    """Interrupt every command so many times, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--longest", type=float, default=8.0, help="latest moment [s]")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    draw, wrong = random.Random(args.seed), 0
    for name, command in COMMANDS.items():
        ends: Counter[str] = Counter()
        for _ in range(args.times):
            with tempfile.TemporaryDirectory() as folder:
                after = args.longest * draw.random() ** 2 + 0.05
                ends[interrupted(command, after, Path(folder)) or "one line, status 130"] += 1
        print(name, dict(ends), flush=True)
        wrong += args.times - sum(ends[end] for end in ("one line, status 130", "done", "before Python had begun"))
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
