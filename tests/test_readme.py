"""The README's Python prints what it says, and its commands are the ones that are tested."""

import contextlib
import io
import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_the_code_prints_its_output():
    """The first Python block, run, prints the text block that follows."""
    code, output = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", README, re.DOTALL).groups()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "README.md", "exec"), {})
    assert printed.getvalue() == output


def test_the_continuous_integration_runs_the_readme_commands():
    """What a newcomer is told to type is what is run."""
    script = (ROOT / ".ci" / "run").read_text()
    for command in re.findall(r"pip install (\S+) && (.*)", README):
        assert command[0] in script or command[0] == "."
        assert command[1].split("/")[0].split()[0] in script
