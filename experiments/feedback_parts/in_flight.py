"""Feedback within the motion: every manoeuvre of a word is flown under `Steering`, which goes on from one to the next.

The orientation is read 200 times a second, not only after each manoeuvre. `Steering` estimates the links' inertias and
steers each manoeuvre to where the estimated robot was to end it; between manoeuvres the amplitudes that are left of the
word are corrected for the estimated robot, as in the way "every manoeuvre".
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from feedback_parts.correcting import LINKS, NOMINAL, SPREAD, Words, along, correct, turns
from reojax import so3

TICK, EDGE = 5e-3, 0.155
TICKS = round(4 * EDGE / TICK)
_FINE = 2
_SCALES = [f"inertia_scale[{link}]" for link in range(LINKS)]


class InFlight:
    """What m runs have done, and what each one's `Steering` knows."""

    def __init__(self, truth: np.ndarray, noise: float):
        self.now = np.tile(np.eye(3), (len(truth), 1, 1))
        self._scale, self._noise, self._key = np.exp(SPREAD * truth), noise, jax.random.key(1)
        self._laws: Any = None
        self._states: Any = None

    def believed(self) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the inertias (m, links) in standard deviations, and the orientation now, both as estimated."""
        values = np.maximum(np.asarray(self._states.values), 0.1)
        seen = np.asarray(self._laws.frame) @ np.asarray(self._states.rotation)
        return np.log(values) / SPREAD, seen

    def fly_word(self, words: Words, target: np.ndarray) -> None:
        """Fly the words; after every manoeuvre correct what is left of them."""
        z = np.zeros((len(self.now), LINKS)) if self._states is None else self.believed()[0]
        for slot in range(words.last.shape[1]):
            one = Words(*(field[:, slot : slot + 1] for field in words))
            self._fly(one, z)
            if words.used[:, slot + 1 :].any():
                z, seen = self.believed()
                rest = correct(z, Words(*(field[:, slot + 1 :] for field in words)), seen, target)
                words.x[:, slot + 1 :] = rest.x

    def _fly(self, one: Words, z: np.ndarray) -> None:
        """One manoeuvre of each run; where a word has none left, all stays as it is."""
        used = one.used[:, 0]
        goals = along(np.tile(np.eye(3), (len(used), 1, 1)), turns(z, one).rotation)[:, -1]
        fresh = [_law(self._noise, *row) for row in zip(one.last[:, 0], one.x[:, 0], used, goals, strict=True)]
        laws = jax.tree.map(lambda *x: np.stack([np.asarray(v) for v in x]), *fresh)
        if self._states is None:
            laws, states = laws, jax.vmap(lambda law: law.start())(laws)
        else:
            laws, states = jax.vmap(lambda law, state, new: law.resume(state, new))(self._laws, self._states, laws)
        self._key, key = jax.random.split(self._key)
        keys = jax.random.split(key, len(used))
        now, after = _flights(laws, states, self.now, self._scale, keys, np.asarray(self._noise))

        def chosen(new, old):
            return np.where(used.reshape(-1, *(1,) * (np.ndim(new) - 1)), new, old)

        self.now = chosen(np.asarray(now), self.now)
        if self._states is None:
            if not used.all():  # where the word is empty, nothing is known or changed
                after = jax.tree.map(chosen, after, states)
            self._laws, self._states = laws, after
        else:
            self._laws = jax.tree.map(chosen, laws, self._laws)
            self._states = jax.tree.map(chosen, after, self._states)


def _law(noise: float, last: float, x: np.ndarray, used: bool, goal: np.ndarray) -> Any:
    kind = reojax.manoeuvre_a if last < 0 else reojax.manoeuvre_b
    path = kind(*x) if used else kind(1.0, 1.0)
    trajectory = reojax.along(path, "quintic", np.full(4, EDGE))
    return reojax.Steering(
        NOMINAL, trajectory, noise=noise, parameters=_SCALES, parameters_std=[SPREAD] * LINKS, samples=12, steps=24,
        goal=goal if used else None,
    )  # fmt: skip


@jax.jit
@partial(jax.vmap, in_axes=(0, 0, 0, 0, 0, None))
def _flights(law: Any, state: Any, rotation: Any, scale: Any, key: Any, noise: Any) -> tuple[Any, Any]:
    """True orientations and states at the end; joints that obey, nothing late."""
    truth = NOMINAL.replace(inertia=NOMINAL.inertia * scale[:, None, None])
    tilt = jax.vmap(so3.exp)(noise * jax.random.normal(key, (TICKS, 3)))
    plan = law.model.trajectory

    def tick(carry: tuple, inputs: tuple) -> tuple[tuple, None]:
        state, r, joints, told = carry
        k, tilt = inputs
        rate = (told - joints) / TICK
        for part in range(_FINE):
            theta = joints + (part + 0.5) / _FINE * (told - joints)
            r = r @ so3.exp(TICK / _FINE * reojax.base_velocity(truth, theta, rate))
        state, references = law.update(state, reojax.Reading(k * TICK, told, r @ tilt, k * TICK))
        # at the end of a manoeuvre the joints are back where they began
        wanted = jnp.where(k < TICKS - 1, references.theta, plan.at(k * TICK + TICK).theta)
        return (state, r, told, wanted), None

    first = plan.at(0.0).theta
    (state, r, *_), _ = jax.lax.scan(
        tick, (state, rotation, first, plan.at(TICK).theta), (jnp.arange(1, TICKS + 1), tilt)
    )
    return r, state
