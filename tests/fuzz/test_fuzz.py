"""A short run of hostile input (`long.py` runs longer): nothing silently wrong, nothing from deep inside."""

import random
from itertools import islice

import pytest

from fuzz import hostile


@pytest.mark.parametrize("seed", range(4))
def test_hostile_arguments(seed):
    """The same ones each time; of functions that compile little."""
    tally, draw = hostile.Tally(), random.Random(seed)
    quick = (what_call for what_call in hostile.hostile_calls(draw) if what_call[0].split("(")[0] not in SLOW)
    for what, call in islice(quick, 200):
        tally.judge(what, call)
    assert not tally.found
    assert tally["refused by name"] > 100


SLOW = {"simulate", "released", "release.momentum", "track", "calibrate", "minimum_time", "net_rotation"}


def test_damaged_captures():
    tally = hostile.Tally()
    for what, call in islice(hostile.hostile_files(random.Random(1)), 300):
        tally.judge(what, call)
    assert not tally.found
    assert min(tally["refused by name"], tally["fine"]) > 8


def test_hostile_command_lines(monkeypatch, tmp_path):
    monkeypatch.setenv("REOJAX_CACHE", "0")
    monkeypatch.chdir(tmp_path)
    tally, quick = hostile.Tally(), ("sweep", "merge", "export")
    lines = (pair for pair in hostile.hostile_lines(random.Random(1)) if pair[0][0] in quick)
    for what, call in islice(lines, 150):
        tally.judge(str(what)[:300], call)
    assert not tally.found
    assert tally["refused by name"] > 100
