"""Public robot files: which load, whether momentum agrees with Pinocchio and MuJoCo, and what turns them.

    python experiments/any_robot.py [--part loading] [--quick]

needs the extras `models`, `oracle` and `zoo`; --quick leaves out what needs a package that is missing. Writes
any_robot_PART.json and prints the tables of docs/models.md.
"""

import json
import time
from importlib import import_module
from pathlib import Path

from any_robot_parts.files import Missing
from common.script import options, run

PARTS = ("loading", "turning", "random_targets")
"""Modules of `any_robot_parts`, each with a function of its own name."""


def main(out: Path, quick: bool, part: str | None) -> dict:
    """Run the parts, write their results, and print them."""
    answer = {"converged": True}
    for name in PARTS if part is None else (part,):
        module, start = import_module(f"any_robot_parts.{name}"), time.process_time()
        try:
            found = getattr(module, name)(quick)
        except Missing as missing:
            if not quick:
                raise
            print(f"{name} left out: {missing}")
            continue
        found["cpu_seconds"] = time.process_time() - start
        (out / f"any_robot_{name}.json").write_text(json.dumps(found, indent=2) + "\n")
        _print(name, found)
        answer["converged"] &= found.get("converged", True)
    return answer


def _print(name: str, found: dict) -> None:
    print(f"\n{name}, {found['cpu_seconds']:.0f} s of CPU")
    for key, value in found.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            print(f"\n| {' | '.join(value[0])} |\n|{'---|' * len(value[0])}")
            print("\n".join(f"| {' | '.join(str(cell)[:160] for cell in row.values())} |" for row in value))
        elif isinstance(value, dict):
            print(f"\n{key}: {value}")


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--part", choices=PARTS, help="one part alone")
    run(main, parser)
