"""`--clearance`: lengths with units, the check of a manoeuvre, and refusals."""

import json

import pytest

from reojax.cli import main
from reojax.cli._clearance import length


@pytest.mark.parametrize(("text", "metres"), [("5mm", 0.005), ("0.5 cm", 0.005), ("0.005m", 0.005), ("0mm", 0.0)])
def test_lengths_have_units(text, metres):
    assert length(text) == pytest.approx(metres)


@pytest.mark.parametrize("text", ["5", "-5mm", "mm", "nan m", "5 km", "inf mm"])
def test_other_lengths_are_refused(text, capsys):
    assert main(["simulate", f"--clearance={text}"]) == 2
    assert "is not a length" in capsys.readouterr().err


def test_simulate_proves_the_clearance(capsys):
    assert main(["simulate", "--clearance", "5mm"]) == 0
    assert "clear: 16.281 mm proven along the whole path; least between link0" in capsys.readouterr().out


def test_simulate_ends_with_1_where_parts_meet(capsys):
    assert main(["simulate", "--manoeuvre", "b", "--twist", "-270", "--clearance", "5mm", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["clearance"]
    assert not found["kept"]
    assert found["found_m"] < -0.005
    assert 1 < found["at_edge"] < 2
    assert "link0" in found["pair"]


def test_robots_without_pairs_are_refused(capsys):
    assert main(["simulate", "--robot", "planar2", "--clearance", "5mm"]) == 2
    assert capsys.readouterr().err.startswith("reojax simulate: ")


def test_view_and_export_prove_the_clearance(capsys, tmp_path):
    page, table = tmp_path / "turn.html", tmp_path / "turn.csv"
    assert main(["view", "--clearance", "5mm", "--out", str(page)]) == 0
    assert "clear: 16.281 mm proven" in capsys.readouterr().out
    assert "least clearance" in page.read_text()
    meeting = ["--manoeuvre", "b", "--twist", "-270", "--clearance", "5mm"]
    assert main(["view", *meeting, "--out", str(page)]) == 1
    assert "NOT clear by 5 mm" in capsys.readouterr().out
    assert main(["export", str(table), "--duration", "1", *meeting]) == 1
    assert "NOT clear by 5 mm" in capsys.readouterr().err
    assert not table.exists()
    assert main(["export", str(table), "--duration", "1", "--clearance", "5mm"]) == 0
    assert table.exists()


def test_show_says_where_the_clearance_is_least(capsys):
    assert main(["show", "prototype", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["clearance"]
    first, second = found["nearest_points_m"]
    assert sum((a - b) ** 2 for a, b in zip(first, second, strict=True)) ** 0.5 == pytest.approx(found["found_m"])
    assert main(["show", "planar2"]) == 0
    assert "clearance: none" in capsys.readouterr().out
