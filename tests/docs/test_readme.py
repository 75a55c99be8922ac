"""The README's commands are the ones that are tested."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
COMMANDS = [block.strip() for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL)]


def test_two_commands_come_first():
    """One installs and runs the main job, one installs and runs the tests."""
    job, tests = COMMANDS[:2]
    assert re.fullmatch(r"pip install \. && python experiments/design_opt\.py", job)
    assert re.fullmatch(r'pip install -e "\.\[[\w,]+\]" && pytest', tests)


def test_the_extras_exist():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    named = re.findall(r"\[([\w,]+)\]\"", README)
    assert named
    assert {name for group in named for name in group.split(",")} <= extras.keys()


def test_the_continuous_integration_runs_the_readme_commands():
    """What a newcomer is told to type is what is run: the same extras, pytest, and the main job with --quick."""
    script = (ROOT / ".ci" / "run").read_text()
    install, _, run = COMMANDS[1].partition(" && ")
    assert install.removeprefix("pip install ") in script
    assert re.search(rf"^\s*{run}\b", script, re.MULTILINE)
    assert 'python "$root/experiments/$1.py" --quick' in script
    assert "cd experiments && ls ./*.py" in script
    assert (ROOT / COMMANDS[0].split()[-1]).parent == ROOT / "experiments"
