"""The API reference has every public name, with a docstring that says shapes and units where there are any."""

import importlib
import importlib.util
import inspect
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import reojax

ROOT = Path(__file__).parents[2]
_spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "site" / "reference.py")
assert _spec is not None
assert _spec.loader is not None
reference = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(reference)

PAGES = reference.pages()
NAMES = reference.public_names()


def test_every_public_name_has_an_entry():
    """Those of `reojax.__all__`, of `so3`, and of the public packages."""
    entries = "\n".join(PAGES.values())
    wanted = {f"reojax.{name}" for name in reojax.__all__ if not inspect.ismodule(getattr(reojax, name))}
    for module in ("design", "plot", "robots", "sweeps", "so3"):
        inside = importlib.import_module(f"reojax.{module}")
        for name, value in vars(inside).items():
            home = getattr(value, "__module__", "")
            if name.startswith("_") or inspect.ismodule(value) or not home.startswith("reojax") or "._" in home:
                continue
            if f"reojax.{name}" not in NAMES and (module != "so3" or home == "reojax.so3") and callable(value):
                wanted.add(f"reojax.{module}.{name}")
    assert not {name for name in wanted if f"heading: {name}\n" not in entries}


def test_entries_lead_to_what_they_name():
    """The module that an entry points to defines a thing of that name."""
    for name, home in NAMES.items():
        assert hasattr(importlib.import_module(home), name.rpartition(".")[2]), name


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("mkdocs") is None, reason="no mkdocs: pip install reojax[docs]")
def test_the_site_builds_without_a_warning(tmp_path):
    """Broken links and signatures that do not fit their docstrings among them."""
    command = ["mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path / "site"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=None)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "site" / "reference" / "mechanics" / "index.html").stat().st_size > 10_000


def test_the_gallery_is_a_notebook_too(tmp_path):
    """Valid by its format, with the page's blocks as cells; that they run is tested where all pages' blocks are."""
    page = (ROOT / "docs" / "gallery.md").read_text()
    book = json.loads(reference.notebook(page))
    code = ["".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "code"]
    assert len(code) == page.count("```python")
    assert all(compile(text, "cell", "exec") for text in code)
    assert len({cell["id"] for cell in book["cells"]}) == len(book["cells"])
    if importlib.util.find_spec("nbformat"):
        import nbformat

        nbformat.validate(nbformat.reads(json.dumps(book), as_version=4))


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("nbclient") is None, reason="no nbclient: pip install reojax[docs]")
def test_the_gallery_runs_as_a_notebook(tmp_path):
    """In a kernel of its own, from an empty folder; what it draws lies there afterwards."""
    import nbclient
    import nbformat

    page = (ROOT / "docs" / "gallery.md").read_text()
    book = nbformat.reads(reference.notebook(page), as_version=4)
    nbclient.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    printed = [out for cell in book.cells if cell.cell_type == "code" for out in cell.outputs]
    assert any("True" in out.get("text", "") for out in printed)
    made = re.findall(r'"(\w+\.(?:png|html))"', page)
    assert made
    assert all((tmp_path / name).stat().st_size > 1000 for name in made)
