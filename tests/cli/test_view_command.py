"""`reojax view`: pages of manoeuvres and plans; what cannot be shown is said in one line."""

import json
from pathlib import Path

import pytest

from reojax.cli import main


def plan_file(folder, **changes):
    plan = {
        "config": {"robot": "prototype", "target": "rotvec 0 0 10"},
        "target_matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "waypoints_rad": [[0, 0, 0], [0, 0.5, 0], [0.5, 0.5, -0.5], [0.5, 0, -0.5], [0, 0, 0]],
    }
    file = folder / "plan.json"
    file.write_text(json.dumps(plan | changes))
    return file


def test_page_of_a_manoeuvre(tmp_path, capsys):
    out = tmp_path / "turn.html"
    assert main(["view", "--manoeuvre", "b", "--twist", "60", "--bend", "40", "--out", str(out)]) == 0
    assert "needs no network" in capsys.readouterr().out
    assert "Manoeuvre B on prototype: twist 60\\u00b0, bend 40\\u00b0" in out.read_text()


def test_page_of_two_plans_in_time(tmp_path):
    plan, out = plan_file(tmp_path), tmp_path / "turn.html"
    assert main(["view", str(plan), "--beside", str(plan), "--duration", "0.4", "--out", str(out)]) == 0
    text = out.read_text()
    assert '"timed":true' in text
    assert text.count("rotvec 0 0 10") >= 2


REFUSED = {
    "there is no folder": ["--out", "nowhere/turn.html"],
    "ends in one of .html": ["--out", "turn.png"],
    "cannot read 'nothing.json'": ["nothing.json"],
    "there is no robot": ["--robot", "hal"],
    "it shows the robot alone": ["--live", "--out", "turn.html"],
}


@pytest.mark.parametrize("words", REFUSED)
def test_refusals_are_one_line(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["view", *REFUSED[words]]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"config": 3}, "must name the robot"),
        ({"waypoints_rad": [[0, 0]]}, "it must be (n, 3)"),
        ({"waypoints_rad": [[0, 0, "x"]]}, "must be an array of real numbers"),
        ({"target_matrix": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}, "no rotation"),
    ],
)
def test_bad_plans(changes, words, tmp_path, capsys):
    assert main(["view", str(plan_file(tmp_path, **changes)), "--out", str(tmp_path / "turn.html")]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.slow
def test_page_beside_the_numbers(tmp_path, capsys):
    """`--html` writes what `simulate`, `plan` and `compare` computed."""
    names = [str(tmp_path / f"{k}.html") for k in "spc"]
    capture = str(Path(__file__).parents[2] / "docs" / "synthetic_capture.csv")
    assert main(["simulate", "--twist", "60", "--duration", "1", "--html", names[0]]) == 0
    assert main(["plan", "--target", "rotvec 0 0 20", "--html", names[1]]) == 0
    assert main(["compare", capture, "--html", names[2]]) == 0
    assert '"timed":true' in Path(names[0]).read_text()
    assert '"target":[[' in Path(names[1]).read_text()
    assert '"role":"measured"' in Path(names[2]).read_text()
