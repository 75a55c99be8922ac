"""An atlas of turns: what twelve robots can do in free fall, what it costs, and how sure that is.

    python experiments/atlas.py                        # all of it
    python experiments/atlas.py --quick                # the prototype alone, coarse, without what takes long
    python experiments/atlas.py --part turns --robot Go1

Rows are saved in `atlas.json` as they are found, and an interrupted run goes on where it stopped. Public robots come
from packages (extra `zoo`); those that are not installed are left out. The numbers of a run are in docs/atlas.md.

Parts: `turns` (1: what one loop does, least travel and time), `thesis` (2: the thesis's robot with 5 mm of clearance),
`sensitivity` and `design` (3: which number matters most, and what gradients choose), `bounds` (4: how far from the
best), `flight` (5: what errors do, open loop and steered), `motors` (6: the thesis's figure 3.2).
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from any_robot_parts.files import Missing
from atlas_parts.store import Store
from atlas_parts.subjects import ENTRIES, Subject, subject
from common.script import options, run
from tqdm import tqdm

from reojax.files import check_writable

PARTS = ("turns", "thesis", "bounds", "sensitivity", "design", "flight", "motors")
QUICK_ROBOTS = ("prototype",)


def main(out: Path, quick: bool, part: str | None, robot: str | None) -> dict[str, Any]:
    """Find the rows that are missing, write `atlas.json`, tables, pictures and animations, and return the rows."""
    names = [name for name in ENTRIES if robot in (None, name) and (not quick or name in QUICK_ROBOTS or robot)]
    parts = PARTS if part is None else (part,)
    store = Store(check_writable(out / "atlas.json"), {"quick": quick})
    subjects = _subjects(names)
    for name in parts:
        module = import_module(f"atlas_parts.{name}")
        for key, find in tqdm(module.jobs(subjects, store, quick), desc=name, unit="row", file=sys.stderr):
            store.row(f"{name}/{key}", find)
        module.show(store.under(name), out)
    print(f"wrote {store.file}")
    return {"rows": store.rows, "converged": all(_holds(row) for row in store.rows.values())}


def _subjects(names: list[str]) -> list[Subject]:
    """The robots that are there."""
    found = []
    for name in names:
        try:
            found.append(subject(name))
        except Missing as missing:
            print(f"{name} left out: {missing}")
    return found


def _holds(row: Any) -> bool:
    """Whether every certificate in a row holds."""
    if isinstance(row, dict):
        return row.get("holds", True) and all(map(_holds, row.values()))
    return all(map(_holds, row)) if isinstance(row, list) else True


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--part", choices=PARTS, help="one part alone")
    parser.add_argument("--robot", choices=tuple(ENTRIES), help="one robot alone")
    run(main, parser)
