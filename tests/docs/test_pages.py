"""Every code block of the README and of the pages in docs does what it says.

Python blocks of one page are run in order in one namespace, from an empty folder; a `text` block right after one is
what it prints (`...` stands for anything). Lines of shell blocks that call `reojax` have options that the command
line takes.
"""

import contextlib
import doctest
import io
import re
import shlex
from pathlib import Path

import pytest

from reojax.cli import parse

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
_CHECKER = doctest.OutputChecker()
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def blocks(page: Path) -> list[tuple[str, str, str]]:
    """Language, text, and the text of a `text` block that follows at once, of each block of a page."""
    text, found = page.read_text(), []
    for match in _BLOCK.finditer(text):
        after = re.match(r"\n\n```text\n(.*?)^```$", text[match.end() :], re.DOTALL | re.MULTILINE)
        found.append((match[1], match[2], after[1] if after else ""))
    return found


WITH_PYTHON = [page for page in PAGES if any(kind == "python" for kind, _, _ in blocks(page))]
COMMANDS = [
    (page.name, command)
    for page in PAGES
    for kind, text, _ in blocks(page)
    if kind == "sh"
    for command in re.findall(r"^reojax .*$", text.replace("\\\n", " "), re.MULTILINE)
]


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.name, marks=pytest.mark.slow if page.parent != ROOT else ()) for page in WITH_PYTHON],
)
def test_python_blocks_run_and_print_what_they_say(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("REOJAX_CACHE", "0")
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    space: dict = {"__name__": page.stem}
    for kind, code, output in blocks(page):
        if kind == "python":
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(code, page.name, "exec"), space)
            if output:
                assert _CHECKER.check_output(output, printed.getvalue(), doctest.ELLIPSIS), printed.getvalue()


@pytest.mark.parametrize(("page", "command"), COMMANDS)
def test_commands_have_options_that_exist(page, command):
    parse(shlex.split(command, comments=True)[1:])
