"""What fastest motions compile is let go with the kind of motion that it was for."""

import gc
from typing import Any

import jax
import numpy as np

import reojax
from reojax.motion import _transcription
from reojax.motion._feasibility import ends_of
from reojax.motion._parametrisation import SplineLoop
from reojax.motion._transcription import Numbers, Transcription, programs_of

KEPT = 2
"""How many kinds are kept here, and half of how many there are."""


def programs_alive() -> int:
    gc.collect()
    return len(jax.devices()[0].client.live_executables())


def test_programs_of_a_few_kinds_are_kept(monkeypatch):
    """A sweep over kinds of motions holds on to the programs of the last few."""
    few = _transcription.lru_cache(maxsize=KEPT)(programs_of.__wrapped__)
    monkeypatch.setattr(_transcription, "programs_of", few)
    ends = ends_of(reojax.robots.prototype())
    nothing: Any = None
    numbers = Numbers(*[nothing] * 5, motion=np.zeros(2))
    alive = []
    for knots in range(4, 4 + 2 * KEPT):
        kind = Transcription(SplineLoop(knots), ends, apart=False)
        x = np.concatenate([np.full(knots, 0.1), np.linspace(0, 1, 2 * (knots - 1))])
        motion = _transcription.programs_of(kind).build(x, numbers)
        np.testing.assert_allclose(np.asarray(motion.breaks)[-1], 0.1 * knots, rtol=1e-6)
        alive.append(programs_alive())
    assert alive[0] > 0
    assert max(alive[KEPT - 1 :]) <= alive[KEPT - 1]
