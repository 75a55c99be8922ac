"""How many targets a second are planned, words of manoeuvres and free paths, beside another version by turns.

    python benchmarks/planning.py                       # two minutes; --quick: fewer targets, one turn
    python benchmarks/planning.py --against FOLDER      # beside another version, unpacked there

Haar targets from a fixed seed. Every turn is a process of its own; in it each row is planned twice and the second time
counts, by the clock. The best of three turns. Writes planning.json. `--only TEXT ...` takes the rows whose names
contain one.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from _command import chosen, comparison_options, machine, run, say, versions
from _planning_rows import ROWS

from reojax.files import check_writable, write_json


def main(out: Path, *, quick: bool, against: Path | None, only: list[str] | None) -> None:
    """Measure by turns, print and write."""
    result = check_writable(out / "planning.json")
    homes = versions(against)
    names = chosen(ROWS, only)
    turns: dict[str, list[dict]] = {home: [] for home in homes}
    for turn in range(1 if quick else 3):
        for home, place in homes.items():
            say(f"turn {turn + 1}, {home} ...")
            turns[home].append(_turn(place, names, 0.1 if quick else 1.0))
    print("| targets a second | " + " | ".join(f"{home} | reached | travel, deg" for home in homes) + " |")
    print("|---|" + "--:|" * 3 * len(homes))
    for name in names:
        cells = []
        for runs in turns.values():
            best = max((run[name] for run in runs if name in run), key=lambda row: row["rate"], default=None)
            if best is None:
                cells += [""] * 3
                continue
            cells += [f"{best['rate']:.4g}", f"{best['reached']:.1%}", f"{best['travel']:.0f}"]
        print(f"| {name} | " + " | ".join(cells) + " |")
    write_json(result, {"machine": machine(), "turns": turns})
    say(f"wrote {result}")


def _turn(home: Path, names: list[str], share: float) -> dict[str, dict[str, float]]:
    """One process of the version at `home`."""
    environment = {**os.environ, "PYTHONPATH": f"{home}{os.pathsep}{Path(__file__).parent}"}
    code = f"import json, _planning_rows; print(json.dumps(_planning_rows.measure({names!r}, {share})))"
    done = subprocess.run([sys.executable, "-c", code], env=environment, cwd=home, stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


if __name__ == "__main__":
    run(main, comparison_options(__doc__))
