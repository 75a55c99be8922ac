"""How fast are net rotations and their gradients, beside other people's ways to the same numbers?

    python benchmarks/run.py                        # about 5 minutes on 2 cores; --quick is shorter
    python benchmarks/run.py --only reojax c casadi

Prints one table and writes benchmarks.json. `benchmarks/README.md` says how to read it. Systems that are not installed
are left out, with the reason. No two of them run at the same time; keep the machine quiet.
"""

from pathlib import Path

from _command import machine, options, run, say
from _table import notes, table, update
from systems import SYSTEMS
from systems._magnus import fewest_steps
from systems._rows import Missing, Row
from systems._task import REFERENCE_STEPS, TOLERANCE, Reference, Task, random_loops
from systems.ode import independent_check
from tqdm import tqdm

from reojax.files import check_writable, write_json

README = Path(__file__).with_name("README.md")
LOOPS = 1024


def main(out: Path, *, quick: bool, only: list[str] | None, update_readme: bool) -> None:
    """Measure the systems; print the table, write the JSON."""
    if update_readme and (quick or only):
        raise ValueError("the README holds the table of a full run: --update-readme goes without --quick and --only.")
    result = check_writable(out / "benchmarks.json")
    before = machine()
    task, check = _task(quick)
    rows: list[Row] = []
    missing: dict[str, str] = {}
    names = list(dict.fromkeys(only or SYSTEMS))
    with tqdm(names, unit="system") as bar:
        for name in bar:
            bar.set_description(name)
            try:
                rows.extend(SYSTEMS[name](task))
            except Missing as reason:
                missing[name] = str(reason)
            except Exception as error:
                if name.startswith("reojax"):
                    raise
                missing[name] = f"failed here: {type(error).__name__}: {str(error).partition(chr(10))[0]}"
    text = "\n".join([table(rows), "", *notes(rows, missing, before, task, check)])
    print(text)
    write_json(
        result,
        {
            "quick": quick,
            "tolerance": TOLERANCE,
            "loops checked": task.checked,
            "reference": {"steps": REFERENCE_STEPS, "error against DOP853": check},
            "machine": {**before, "load after": machine()["load"]},
            "missing": missing,
            "rows": [row._asdict() for row in rows],
        },
    )
    say(f"wrote {result}")
    if update_readme:
        update(README, text)
        say(f"updated {README}")


def _task(quick: bool) -> tuple[Task, float | None]:
    say("reference, and steps of the fourth-order method ...")
    loops, checked = random_loops(LOOPS), 128 if quick else 512
    reference = Reference(loops, checked)
    task = Task(loops, checked, quick, 0.3 if quick else 2.0, 0, reference)
    check = independent_check(reference, 1 if quick else 4)
    return task._replace(magnus_steps=fewest_steps(reference)), check


if __name__ == "__main__":
    parser = options(__doc__)
    parser.add_argument("--only", nargs="+", choices=SYSTEMS, metavar="SYSTEM", help=f"of {', '.join(SYSTEMS)}")
    parser.add_argument("--update-readme", action="store_true", help="put the table into benchmarks/README.md")
    run(main, parser)
