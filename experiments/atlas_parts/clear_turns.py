"""Turns of little travel that keep a clearance, of robots with many pairs of shapes: by a working set of pairs.

A search that looks at all pairs of a legged robot at every step takes minutes. Most pairs hardly ever come near each
other. So a search looks only at pairs which came too near on promising random polygons, then also at those which do on
what it finds, and so on; what is handed on is proven with all pairs.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np

import reojax
from atlas_parts.subjects import Subject
from reojax.collision.refusal import check_clearance
from reojax.planning.checks import key_of
from reojax.planning.clear_paths import Clear
from reojax.planning.free_polygons import polygons_of
from reojax.planning.free_search import Search
from reojax.planning.freedom import freedom_of
from reojax.planning.polygon_table import PolygonTable, table_of
from reojax.robots import with_capsules

_ROUNDS = 3
"""How often pairs are added."""
_OFTEN = 0.02
"""Share of promising random polygons on which a pair of the working set comes too near."""
_LOOKED_AT = 512
"""Random polygons that are looked at for an axis."""
_USED = 0.97
"""Share of the farthest loop that a run is asked for."""
_ANY = 2.95
"""A loop that turns this far [rad], nearly the most that is looked for, is taken to do for any turn about its axis."""
_TRIES = 2
"""Numbers of runs tried, each a quarter more than the one before, or one."""
_EVEN, _RANDOM = (1.0, 0.6, 0.4), 2
"""Shares of the box of joint limits, and number of random boxes."""
_SAMPLES = 48
"""Postures per edge at which pairs are looked at for being too near."""
_OFF = np.deg2rad(0.1)
"""Largest off-axis part of a loop that counts as turning about an axis [rad]."""
_CORNERS = ((4, 8), (8, 6), (10**9, 5))
"""Most moving joints, and free corners, as `free_path` has them."""


class Effort(NamedTuple):
    """How hard to search."""

    starts: int
    steps: int


class Turns(NamedTuple):
    """One path for each of m targets."""

    waypoints: np.ndarray
    """(m, v, j) corners of one run [rad]."""
    runs: np.ndarray
    """(m,) how often each is run."""
    travel: np.ndarray
    """(m,) joint travel of all runs [rad]."""
    reached: np.ndarray
    """(m,) whether it ends on its target, with the clearance if one was asked for."""
    status: np.ndarray
    """(m,) in words."""
    most: np.ndarray
    """(m,) how far one loop was found to turn about the target's axis [rad]."""
    farthest: np.ndarray
    """(m, v, j) that loop."""


def free_turns(subject: Subject, targets: np.ndarray, effort: Effort) -> Turns:
    """Turns without a clearance."""
    finder = _Finder(subject, subject.robot, None, effort)
    found = finder.nothing(targets)
    finder.improve(found, targets, np.arange(len(targets)))
    return found


def clear_turns(subject: Subject, targets: np.ndarray, effort: Effort) -> Turns:
    """Turns that keep the subject's clearance, proven with all pairs."""
    robot, pairs = subject.robot, _often_near(subject, targets, effort)
    found = None
    for _ in range(_ROUNDS):
        few = with_capsules(robot, robot.capsules, sorted(pairs)) if pairs else robot
        finder = _Finder(subject, few, subject.clearance if pairs else None, effort, proof=subject.clearance)
        found = finder.nothing(targets) if found is None else found
        going = np.flatnonzero(~found.reached)
        tried = finder.improve(found, targets, going)
        new = _too_near(robot, tried, subject.clearance, 0.0) - pairs
        if not new or found.reached.all():
            break
        pairs |= new
    assert found is not None
    return found


def boxed_turns(
    subject: Subject, targets: np.ndarray, effort: Effort, *, most: int | None = None
) -> tuple[Turns, Turns]:
    """Turns that keep the subject's clearance, for robots of many joints and pairs: within boxes where little touches.

    The search looks at no pair at all; it is made within smaller and smaller boxes about the posture at rest, and
    within random ones, and of its answers those count which are proven clear with all pairs. The second answer are the
    turns of the largest box, clear or not. `most` boxes, by default all.
    """
    best = touching = None
    for low, high in _boxes(subject)[:most]:
        finder = _Finder(subject, subject.robot, None, effort, (low, high), subject.clearance, tries=1)
        found = finder.nothing(targets)
        finder.improve(found, targets, np.arange(len(targets)))
        if best is None:
            best, touching = finder.nothing(targets), finder.touching
        for k in range(len(targets)):
            if found.reached[k] and not (best.reached[k] and best.travel[k] <= found.travel[k]):
                for field in ("waypoints", "runs", "travel", "reached"):
                    getattr(best, field)[k] = getattr(found, field)[k]
            if not best.reached[k] or found.reached[k]:
                best.status[k] = found.status[k]
            if found.most[k] > best.most[k]:
                best.most[k], best.farthest[k] = found.most[k], found.farthest[k]
    assert best is not None
    assert touching is not None
    return best, touching


def _boxes(subject: Subject) -> list[tuple[np.ndarray, np.ndarray]]:
    """Boxes of joint angles about the posture at rest: shares of the robot's own, even ones, then random ones."""
    freedom = freedom_of(subject.robot, start=subject.start, end=None, joints=None, lower=None, upper=None)
    low, high = subject.start.copy(), subject.start.copy()
    place = list(freedom.joints)
    low[place], high[place] = freedom.low, freedom.high
    rng = np.random.default_rng(0)
    shares = [np.full((2, subject.robot.joints), share) for share in _EVEN]
    shares += [rng.uniform(0.1, 1.0, (2, subject.robot.joints)) for _ in range(_RANDOM)]
    start = subject.start
    return [(start + one * (low - start), start + two * (high - start)) for one, two in shares]


def _often_near(subject: Subject, targets: np.ndarray, effort: Effort) -> set[tuple[int, int]]:
    """Pairs that often come too near on random polygons which turn far about the targets' axes."""
    finder = _Finder(subject, subject.robot, None, effort)
    axes = np.unique(np.round(_axes(targets)[0], 12), axis=0)
    x = np.concatenate([finder.table.farthest(axis, _LOOKED_AT // 4) for axis in axes])
    return _too_near(subject.robot, finder.polygons.paths(x, finder.freedom), subject.clearance, _OFTEN)


def _too_near(robot: reojax.Robot, paths: np.ndarray, margin: float, share: float) -> set[tuple[int, int]]:
    """Pairs that come nearer than the margin on more than a share of the paths (m, v, j), by samples."""
    if not robot.collision_pairs or not len(paths):
        return set()
    place = np.linspace(0, 1, _SAMPLES)[:, None]
    near = np.zeros(len(robot.collision_pairs))
    look = jax.jit(jax.vmap(lambda theta: reojax.clearance(robot, theta)))
    for path in paths:
        postures = (path[:-1, None] + place * np.diff(path, axis=0)[:, None]).reshape(-1, robot.joints)
        near += np.asarray(look(postures)).min(0) < margin
    return {robot.collision_pairs[k] for k in np.flatnonzero(near > share * len(paths))}


def _axes(targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (m, 3) and angles (m,) of targets."""
    vectors = np.array([np.asarray(reojax.so3.log(target)) for target in targets])
    angles = np.linalg.norm(vectors, axis=1)
    return vectors / angles[:, None], angles


class _ClearFirst(PolygonTable):
    """Random polygons of which those that keep the clearance come first: a search out of deep contact gets nowhere."""

    kept: Callable[[np.ndarray], np.ndarray]

    def farthest(self, axis: np.ndarray, count: int) -> np.ndarray:
        """The clear ones first of those that turn most about an axis."""
        x = super().farthest(axis, max(_LOOKED_AT, count))
        return x[np.argsort(~self.kept(x), kind="stable")][:count]


class _Finder:
    """A search with some of a robot's pairs, whose answers count only with all pairs proven."""

    def __init__(
        self,
        subject: Subject,
        few: reojax.Robot,
        margin: float | None,
        effort: Effort,
        box: tuple[np.ndarray, np.ndarray] | tuple[None, None] = (None, None),
        proof: float | None = None,
        tries: int = _TRIES,
    ) -> None:
        self.subject, self.few, self.margin, self.effort, self.box = subject, few, margin, effort, box
        self.tries = tries
        self.touching: Turns | None = None
        """What was reached, clear or not."""
        self.proof = margin if proof is None else proof
        with jax.enable_x64(True):
            few = jax.tree.map(lambda leaf: np.asarray(leaf, float), few)
            freedom = freedom_of(few, start=subject.start, end=None, joints=None, lower=box[0], upper=box[1])
            corners = next(number for most, number in _CORNERS if len(freedom.joints) <= most)
            self.freedom, self.polygons = freedom, polygons_of(few, freedom, corners)
            self.table = table_of(self.polygons, freedom, key_of(few), 0)
            clear = None
            if margin is not None:
                clear = Clear(few, *check_clearance(few, margin, {"the posture at rest": subject.start}))
                self.table = _ClearFirst(self.table.x, self.table.turns, self.table.lengths)
                self.table.kept = lambda x: clear.kept(self.polygons.paths(x, freedom))
            self.search = Search(self.polygons, self.table, freedom, effort.starts, effort.steps, 1e-9, clear)

    def nothing(self, targets: np.ndarray) -> Turns:
        """Turns of which none is found yet."""
        count = len(targets)
        stay = np.tile(self.subject.start, (count, self.polygons.corners + 2, 1))
        return Turns(
            stay, np.ones(count, int), np.full(count, np.inf), np.full(count, False),
            np.array(["not found"] * count, object), np.zeros(count), stay.copy(),
        )  # fmt: skip

    def kept(self, paths: np.ndarray) -> np.ndarray:
        """Which paths (m,) are proven to keep the clearance, all pairs looked at; all of them if none is asked for."""
        robot, margin = self.subject.robot, self.proof
        if margin is None or not robot.collision_pairs:
            return np.full(len(paths), True)
        apart = [float(reojax.path_clearance(robot, reojax.Path(path)).distance) for path in paths]
        return np.array(apart) >= margin

    def improve(self, found: Turns, targets: np.ndarray, going: np.ndarray) -> np.ndarray:
        """Solve some of the targets; changes `found`, and returns all paths (n, v, j) that were tried."""
        axes, angles = _axes(targets[going])
        tried = [self._farthest(found, going, axes)]
        able = np.maximum(found.most[going], tried[0][1])
        runs = np.where(able > _ANY, 1, np.ceil(angles / np.maximum(_USED * able, 1e-2))).astype(int)
        paths = [tried[0][0]]
        self.touching = self.nothing(targets)
        for _ in range(self.tries):
            left = np.flatnonzero(~found.reached[going] & (able > 0))
            for number in np.unique(runs[left]):
                mine = left[runs[left] == number]
                paths.append(self._solve(found, targets, going[mine], int(number)))
            runs = np.maximum(runs + 1, 5 * runs // 4)
        if not (able > 0).all():  # is it possible at all?
            paths.append(self._solve(found, targets, going[able <= 0], 1))
        return np.concatenate(paths)

    def _farthest(self, found: Turns, going: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The farthest loops about some axes: all that were looked at, and how far they go, clear or not (m,)."""
        alone, which = np.unique(np.round(axes, 12), axis=0, return_inverse=True)
        with jax.enable_x64(True), self.search.bar(False):
            loops, able = self.search.farthest(alone)
            every = []
            for k, candidates in enumerate(loops):
                paths = self.polygons.paths(candidates, self.freedom)
                every.append(paths)
                angle, best = _best(alone[k], paths, self.polygons.rotations(paths, 16), self.kept(paths))
                for i in going[which == k]:
                    if angle > found.most[i]:
                        found.most[i], found.farthest[i] = angle, best
        return np.concatenate(every), able[which]

    def _solve(self, found: Turns, targets: np.ndarray, mine: np.ndarray, runs: int) -> np.ndarray:
        answer = reojax.free_paths(
            self.few, targets[mine], start=self.subject.start, repeats=runs, clearance=self.margin,
            starts=self.effort.starts, max_steps=self.effort.steps, lower=self.box[0], upper=self.box[1],
        )  # fmt: skip
        reached, touching = answer.converged & self.kept(answer.waypoints), self.touching
        assert touching is not None
        for i, k in enumerate(mine):
            found.status[k] = str(answer.status[i])
            for turns, done in ((found, reached[i]), (touching, answer.converged[i])):
                if done:
                    turns.waypoints[k], turns.runs[k], turns.travel[k] = answer.waypoints[i], runs, answer.travel[i]
                    turns.reached[k] = True
        return answer.waypoints


def _best(axis: np.ndarray, paths: np.ndarray, turns: np.ndarray, kept: np.ndarray) -> tuple[float, np.ndarray]:
    """How far the farthest of some loops turns about an axis [rad], 0 if none is kept; and that loop."""
    vectors = np.array([np.asarray(reojax.so3.log(turn)) for turn in turns])
    along = vectors @ axis
    off = np.linalg.norm(vectors - along[:, None] * axis, axis=1)
    worth = np.where(kept & (off < _OFF), along, 0.0)
    return float(worth.max()), paths[worth.argmax()]
