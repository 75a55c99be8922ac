"""Every command that takes a path says which joints it takes beyond their limits, as text and as JSON."""

import json
from pathlib import Path

import pytest

from reojax import robots
from reojax.cli import main
from reojax.cli._limits import joints_beyond_limits
from reojax.path import polygon

SHIPPED = str(Path(__file__).parents[2] / "docs" / "synthetic_capture.csv")
FAR = ["--bend", "130"]
COMMANDS = {
    "simulate": ["simulate", *FAR],
    "time": ["time", *FAR],
    "export": ["export", "a.csv", *FAR, "--duration", "0.6"],
    "compare": ["compare", SHIPPED, "--manoeuvre", "a", *FAR, "--duration", "0.6"],
    "sweep": ["sweep", "bend=100,130", "twist=-10,20", "--quiet"],
    "view": ["view", *FAR],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_limits_are_told(capsys, monkeypatch, tmp_path, command):
    """Of the bend, 120 degrees on the prototype; and nothing where a path keeps to them."""
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)
    assert main(COMMANDS[command]) == 0
    assert "beyond the joint limits of prototype: bend\n" in capsys.readouterr().out
    within = [word.replace("130", "110") for word in COMMANDS[command]]
    if command == "view":
        assert main(within) == 0
        assert "limits" not in capsys.readouterr().out
        return
    assert main([*within, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["joints_beyond_limits"] == []


def test_limits_hold_on_both_sides_up_to_rounding():
    robot = robots.prototype()
    corners = [[0.0, 0, 0], [float(robot.upper[0]) + 1e-12, float(robot.lower[1]) - 1e-6, 0]]
    assert joints_beyond_limits(robot, [polygon(corners)]) == ["bend"]
