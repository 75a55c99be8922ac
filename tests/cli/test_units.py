"""The command line speaks degrees, in what it reads and in what it complains of."""

import pytest

from reojax.cli import main, parse
from reojax.cli._numbers import in_degrees


@pytest.mark.parametrize(
    ("inside", "told"),
    [
        ("`twist_limit` is 3.141592653589793 rad; too much", "`twist_limit` is 180 degrees; too much"),
        ("its limits are -4.71239 to 4.71239 rad", "its limits are -270 to 270 degrees"),
        ("is limited to -1.5708..1.5708 rad; it", "is limited to -90..90 degrees; it"),
        ("it must be one positive number, in rad.", "it must be one positive number, in degrees."),
        ("is 296.706 rad, more than two turns; is it in degrees?", "is 17000 degrees, more than two turns"),
        ("lower[0] is 1e-2 rad: are these degrees?", "lower[0] is 0.57296 degrees"),
        ("a body rate of 3.2 rad/s, 2 kg", "a body rate of 3.2 rad/s, 2 kg"),
        ("the file 'v1.5 radius.csv' of 3 rads", "the file 'v1.5 radius.csv' of 3 rads"),
        ("up to inf rad", "up to inf degrees"),
    ],
)
def test_messages_have_their_angles_in_degrees(inside, told):
    assert in_degrees(inside).startswith(told)


@pytest.mark.parametrize(
    "words", [["rotvec", "0", "90", "0"], ["rotvec", "-1e-3", "-90", "0"], ["quat", "-0.5", "-.5", "0.5", "-5e-1"]]
)
def test_targets_need_no_quotes(words):
    assert " ".join(parse(["plan", "--target", *words, "--json"]).target).split() == words


def test_vectors_may_begin_with_a_minus():
    assert parse(["simulate", "--momentum", "-0.001,0,0"]).momentum is not None


def test_an_option_of_another_command_is_not_taken_for_a_slip(capsys):
    assert main(["time", "--momentum", "-0.001,0,0"]) == 2
    told = capsys.readouterr().err
    assert "did you mean" not in told
    assert "other commands" in told
    assert main(["simulate", "--law", "quintik"]) == 2
    assert "Did you mean 'quintic'?" in capsys.readouterr().err
