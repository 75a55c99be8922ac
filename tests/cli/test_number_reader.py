"""Numbers with units at the command line: one reader, and degrees in what it says."""

import argparse

import pytest

from reojax.cli import _numbers as read, main


@pytest.mark.parametrize(
    ("reader", "text", "value"),
    [
        (read.degrees, "270", 270.0),
        (read.degrees, "-30 deg", -30.0),
        (read.degrees, "1rad", 57.29577951308232),
        (read.seconds, "500ms", 0.5),
        (read.seconds, "2 s", 2.0),
        (read.length, "5mm", 0.005),
        (read.length, "0.5 cm", 0.005),
        (read.whole, "12", 12),
    ],
)
def test_numbers_with_and_without_units(reader, text, value):
    assert reader(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("reader", "text", "said"),
    [
        (read.degrees, "5mm", "'5mm' is not a number"),
        (read.degrees, "deg", "'deg' is not a number"),
        (read.degrees, "1e999", "'1e999' is not a finite number"),
        (read.degrees, "1000rad", "beyond 36000 degrees"),
        (read.seconds, "1 min", "'1 min' is not a number"),
        (read.seconds, "0ms", "is not a duration in seconds"),
        (read.length, "5", "is not a length"),
        (read.length, "-5mm", "is not a length"),
        (read.whole, "0", "is not a positive whole number"),
        (read.whole, "\u0663", "is not a positive whole number"),
    ],
)
def test_what_is_no_such_number_is_refused(reader, text, said):
    with pytest.raises(argparse.ArgumentTypeError, match=said):
        reader(text)


def test_errors_tell_angles_in_degrees():
    text = "joint 'at 1 rad' is limited to -1.5707963..1.5707963 rad; it goes from 0 to 3.1415927 rad at 2 rad/s."
    told = "joint 'at 1 rad' is limited to -90..90 degrees; it goes from 0 to 180 degrees at 2 rad/s."
    assert read.in_degrees(text) == told


def test_a_limit_of_the_library_is_told_in_degrees(capsys):
    assert main(["plan", "--target", "rotvec 0 90 0", "--twist-limit", "900"]) == 2
    assert "`twist_limit` is 900 degrees, more than two turns" in capsys.readouterr().err
