"""The one rule for numbers from outside: float32 or float64, real, all of them meant."""

import datetime

import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax._internal.arrays import as_numbers, common_float

PROTOTYPE = reojax.robots.prototype()
PATH = reojax.manoeuvre_a(1.0, 1.0)
MASKED = np.ma.masked_array([0.1, 0.2, 0.3, 0.4], [False, True, False, False])
BAD = {
    "timedelta64": (np.timedelta64(500, "ms"), "a time of its own kind; give a number of seconds"),
    "datetime64": (np.datetime64("2026-01-01"), "a time of its own kind"),
    "timedelta": (datetime.timedelta(seconds=1), "a time of its own kind"),
    "masked": (MASKED, "has masked entries"),
    "masked inside": ([MASKED, MASKED], "has masked entries"),
    "float16": (np.float16(0.5), "of type float16; reojax computes in float32 or float64"),
    "bfloat16": (jnp.ones(4, jnp.bfloat16), "of type bfloat16"),
    "longdouble": (np.longdouble(0.5), f"of type {np.dtype(np.longdouble)}"),
    "bool": (True, "only real numbers will do"),
    "bools among numbers": ([0.1, True, 0.3, 0.4], "with truth values in it; only real numbers will do"),
    "bools inside": ([[0.1, 0.2], [0.3, np.False_]], "with truth values in it"),
    "complex": (1j, "only real numbers will do"),
    "text": ("0.5", "only real numbers will do"),
    "megabyte": ("x" * 10**6, "only real numbers will do"),
    "long list": (["x"] * 10**5, "only real numbers will do"),
    "object": (object(), "only real numbers will do"),
    "ragged": ([[1.0], [1.0, 2.0]], "only real numbers will do"),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_plain_number_is_refused_shortly(kind):
    value, message = BAD[kind]
    for call in (
        lambda: as_numbers("entry", value),
        lambda: reojax.simulate(PROTOTYPE, PATH, durations=value),
        lambda: reojax.polygon(value),
    ):
        with pytest.raises(ValueError, match=message) as refusal:
            call()
        assert len(str(refusal.value)) < 500


@pytest.mark.parametrize("kind", sorted(BAD.keys() - {"float16", "bfloat16", "longdouble"}))
def test_robots_are_made_of_plain_numbers_only(kind):
    """By `make_robot`, which has a door of its own, and by `replace`."""
    value = BAD[kind][0]
    for call in (
        lambda: reojax.make_robot(mass=value, com=0, inertia=0, axis=0, anchor=0),
        lambda: PROTOTYPE.replace(mass=value),
        lambda: reojax.robots.with_gear_ratio(PROTOTYPE, value),
    ):
        with pytest.raises(ValueError, match="mass|ratio") as refusal:
            call()
        assert len(str(refusal.value)) < 500


def test_a_path_within_the_limits_of_a_robot():
    inside = reojax.manoeuvre_a(4.0, 2.0).waypoints
    reojax.polygon(inside, check_limits=PROTOTYPE)
    with pytest.raises(
        ValueError, match=r"waypoints\[1, 1\] \(bend\) is 90 rad; the limits of 'prototype' are -2.0944 to"
    ):
        reojax.polygon([[0, 0, 0], [0, 90, 0]], check_limits=PROTOTYPE)
    with pytest.raises(ValueError, match="`waypoints` move 2 joints; 'prototype' has 3"):
        reojax.polygon(inside[:, :2], check_limits=PROTOTYPE)
    with pytest.raises(ValueError, match="`check_limits` is a bool; it must be a Robot"):
        reojax.polygon(inside, check_limits=True)


def test_what_is_meant_passes():
    for value in (1, 0.5, np.int8(3), np.float32(0.5), [1, 2.5], np.ma.masked_array([1.0, 2.0]), jnp.ones(3)):
        assert as_numbers("entry", value).dtype in (np.float32, np.float64)


@pytest.mark.parametrize("dtype", [np.float16, jnp.bfloat16])
def test_half_precision_is_refused_wherever_it_comes_in(dtype):
    half = jnp.asarray(PATH.waypoints, dtype)
    with pytest.raises(ValueError, match="float32 or float64"):
        common_float(PROTOTYPE, half)
    with pytest.raises(ValueError, match="float32 or float64"):
        reojax.net_rotation(PROTOTYPE, reojax.polygon(half))


def test_truth_values_are_no_rotation():
    for call in (
        lambda: reojax.make_capture([0.0, 1.0], rotation=np.stack([np.eye(3, dtype=bool)] * 2)),
        lambda: reojax.plan(PROTOTYPE, np.eye(3, dtype=bool), twist_limit=4.0, bend_limit=2.0, max_manoeuvres=1),
    ):
        with pytest.raises(ValueError, match="only real numbers"):
            call()
