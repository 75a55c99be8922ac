"""Numbers for the table of the thesis's claims: one measurement after the other, no verdicts."""

import numpy as np
from numpy.polynomial import legendre
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import reojax
from reojax import robots
from reojax.mechanics.attitude import zxz_without_jumps
from reojax.motion.motor import RE_MAX_17, no_load_speed
from reojax.motion.simulation import simulate
from reojax.robots.prototype import END_INERTIA, GEAR_RATIO, ROTOR_INERTIA
from thesis.curvature import plane
from thesis.grids import FULL_BEND, FULL_TWIST, Grid, Turn, net, run

SEED = 2019
MEASURED_ROLL = 3.35
"""First ZXZ angle after manoeuvre A in the drop tower [rad] (thesis figure 1.9)."""
Numbers = dict[str, float]


def degrees(rotation: Rotation) -> float:
    """Angle of a rotation [deg]."""
    return float(np.rad2deg(rotation.magnitude()))


FULL_A = reojax.manoeuvre_a(FULL_TWIST, FULL_BEND)
FULL_B = reojax.manoeuvre_b(FULL_TWIST, FULL_BEND)


def amplitudes(grids: dict[str, Grid]) -> Numbers:
    """Figures 1.5, 2.5 to 2.7 and 2.10."""
    a, b = grids["a"], grids["b"]
    roll, tip = np.rad2deg(a.turn.roll), np.rad2deg(a.turn.tip)
    yaw, side = np.rad2deg(b.turn.yaw), np.rad2deg(b.turn.tip_yaw)
    moving = (slice(1, None), slice(1, None))
    axes = Rotation.from_matrix(np.asarray(a.own().turn.rotation)[moving].reshape(-1, 3, 3)).as_rotvec()
    axes = axes * np.sign(axes[:, 2:]) / np.linalg.norm(axes, axis=1, keepdims=True)
    mean = axes.mean(0) / np.linalg.norm(axes.mean(0))
    off = np.rad2deg(np.arccos(np.clip(axes @ mean, -1, 1)))
    steps = [np.diff(roll, axis=axis)[moving] for axis in (0, 1)]
    own_steps = [np.diff(np.rad2deg(a.own().turn.roll), axis=axis)[moving] for axis in (0, 1)]
    own_yaw, own_side = (np.rad2deg(x)[moving] for x in (b.own().turn.yaw, b.own().turn.tip_yaw))
    return {
        "a_roll_deg": roll[-1, -1],
        "a_roll_rad": np.deg2rad(roll[-1, -1]),
        "a_tip_deg": tip[-1, -1],
        "a_tip_largest_deg": tip.max(),
        "a_axis_spread_deg": off.max(),
        "a_least_step_deg": min(step.min() for step in own_steps),
        "a_lowest_roll_deg": roll.min(),
        "a_negative_up_to_bend_deg": np.rad2deg(a.axes[1][np.any(roll < -1e-6, axis=0)].max(initial=0.0)),
        "a_steepest_over_mean_slope": max(
            np.abs(step).max() * roll.shape[axis] / roll.max() for axis, step in enumerate(steps)
        ),
        "a_measured_miss_rad": abs(np.deg2rad(roll[-1, -1]) - MEASURED_ROLL),
        "b_yaw_deg": yaw[-1, -1],
        "b_tip_deg": side[-1, -1],
        "b_largest_off_axis_share": float(np.max(own_side / np.abs(own_yaw))),
        "b_to_a": abs(yaw[-1, -1]) / roll[-1, -1],
    }


def designs(grids: dict[str, Grid]) -> Numbers:
    """Figures 2.8 and 2.9."""
    ends, motor = grids["inertia"].own(), np.rad2deg(grids["motor"].own().turn.roll)
    inertia = ends.axes[0] * 1e6
    roll, tip = np.rad2deg(ends.turn.roll), np.rad2deg(ends.turn.tip)
    fine = grids["inertia"]
    early, late = inertia <= 101, inertia >= 99
    return {
        "end_peak_kg_mm2": float(fine.axes[0][np.argmax(fine.turn.roll)] * 1e6),
        "end_gain_least_step_deg": np.diff(roll[early]).min(),
        "end_loss_least_step_deg": -np.diff(roll[late]).max(),
        "end_roll_at_10_deg": roll[0],
        "end_roll_at_100_deg": roll[3],
        "end_roll_at_190_deg": roll[-1],
        "end_tip_at_100_deg": tip[3],
        "end_tip_at_190_deg": tip[-1],
        "end_tip_least_step_deg": np.diff(tip[late]).min(),
        "gear_least_step_deg": np.diff(motor, axis=0).min(),
        "rotor_least_step_deg": np.diff(motor, axis=1).min(),
        "motor_least_deg": motor.min(),
        "motor_most_deg": motor.max(),
        "nominal_inertia_kg_mm2": END_INERTIA * 1e6,
        "from_grids_kg_mm2": ROTOR_INERTIA * 700 * 1e6,
    }


def middle_links(robot: reojax.Robot) -> Numbers:
    """Thesis 2.7.2: the inertia of the middle links times 1, 10, ... 1e6."""
    factors = 10.0 ** np.arange(7)
    heavy = [np.array([1, k, k, 1])[:, None, None] * robot.inertia for k in factors]
    angle = [degrees(net(robot.replace(inertia=inertia), FULL_A)) for inertia in heavy]
    return {"middle_last_deg": angle[-1], "middle_slope": np.log10(angle[-1] / angle[-2])}


def paths(robot: reojax.Robot) -> Numbers:
    """Thesis 2.4: time does not matter; a path back undoes; other bases and scales change nothing."""
    there = FULL_A.waypoints
    retraced = reojax.polygon(np.concatenate([there[:3], there[1::-1]]))
    whole = net(robot, FULL_A)
    scaled = robot.replace(mass=3 * robot.mass, inertia=3 * robot.inertia, rotor_inertia=3 * robot.rotor_inertia)
    larger = robot.replace(
        com=2 * robot.com, anchor=2 * robot.anchor, inertia=4 * robot.inertia, rotor_inertia=4 * robot.rotor_inertia
    )
    return {
        "time_law_rad": max((_timed(robot, law).inv() * whole).magnitude() for law in LAWS.values()),
        "retraced_deg": degrees(net(robot, retraced)),
        "reversed_deg": degrees(net(robot, reojax.polygon(there[::-1])) * whole),
        "four_body_deg": degrees(whole),
        "scaled_mass_deg": degrees(whole.inv() * net(scaled, FULL_A)),
        "scaled_length_deg": degrees(whole.inv() * net(larger, FULL_A)),
        "other_bend_roll_deg": degrees(net(robot, reojax.manoeuvre_a(FULL_TWIST, -FULL_BEND))),
    }


def six_body() -> Numbers:
    """The full cat: the same mechanism, seen from its first foot (thesis 1.4)."""
    path = reojax.manoeuvre_a(FULL_TWIST, FULL_BEND, reojax.SIX_BODY)
    return {"six_body_deg": degrees(net(robots.six_body(), path))}


def motors(robot: reojax.Robot) -> Numbers:
    """Figure 3.2: distance to the torque-speed line in stall torques, at a bend by 120 degrees."""
    path = reojax.polygon(FULL_A.waypoints[:2])
    times = (110, 100, 90, 80)  # ms
    runs = [simulate(robot, path, "quintic", durations=t / 1000, motors=RE_MAX_17, samples=64) for t in times]
    free = no_load_speed(RE_MAX_17) / RE_MAX_17.gear_ratio
    fastest = [float(np.abs(np.asarray(run.theta_dot)).max() / free) for run in runs]
    bent = np.asarray(reojax.joint_inertia(robot, path.waypoints[-1]))[1, 1]
    numbers = {
        f"margin_at_{t}_ms": float(np.min(np.asarray(run.margin)[:, 1])) for t, run in zip(times, runs, strict=True)
    }
    numbers |= {f"speed_at_{t}_ms": share for t, share in zip(times, fastest, strict=True)}
    return {**numbers, "centre_inertia_kg_mm2": bent * 1e6}


LAWS = {
    "even": lambda t: (t, np.ones_like(t)),
    "quintic": lambda t: (t**3 * (10 - 15 * t + 6 * t**2), 30 * t**2 * (1 - t) ** 2),
    "hurried": lambda t: ((np.exp(3 * t) - 1) / np.expm1(3), 3 * np.exp(3 * t) / np.expm1(3)),
}
"""Share of an edge done at a share t of its time, and the speed there."""


def _timed(robot: reojax.Robot, law) -> Rotation:
    """Integrate A at 270/120 in time, `R' = R hat(connection theta')`: Magnus steps of fourth order, 360 an edge."""
    steps = 360
    node = (legendre.leggauss(2)[0] + 1) / 2
    t = (np.arange(steps)[:, None] + node) / steps
    share, speed = law(t)
    corners = np.array([[0, 0], [FULL_BEND, 0], [FULL_BEND, FULL_TWIST], [0, FULL_TWIST], [0, 0]])
    total = Rotation.identity()
    for start, end in zip(corners, corners[1:], strict=False):
        points = start + share[..., None] * (end - start)
        gamma = plane(robot, -1.0, points.reshape(-1, 2)).gamma.reshape(steps, 2, 3, 2)
        omega = (gamma @ (end - start)) * speed[..., None]
        first, second = omega[:, 0], omega[:, 1]
        turns = (first + second) / (2 * steps) + np.sqrt(3) / 12 * np.cross(first, second) / steps**2
        for factor in Rotation.from_rotvec(turns):
            total = total * factor
    return total


def symmetric(robot: reojax.Robot) -> Numbers:
    """Robots with one symmetry each, and how the turn grows from small amplitudes."""
    mirror = np.diag([1.0, 1.0, -1.0])
    plain = robot.replace(
        rotor_inertia=robot.rotor_inertia * np.array([1.0, 0.0, 1.0])
    )  # no rotor to tell halves apart
    com, inertia = np.array(plain.com), np.array(plain.inertia)
    com[3], inertia[3] = mirror @ com[0], mirror @ inertia[0] @ mirror
    mirrored = plain.replace(com=com, inertia=inertia)

    def parts(robot: reojax.Robot, path: reojax.Path, axis: int) -> tuple[float, float]:
        turned = np.rad2deg(net(robot, path).as_rotvec())
        return float(abs(turned[axis])), float(np.linalg.norm(np.delete(turned, axis)))

    def growth(robot: reojax.Robot, manoeuvre, axis: int) -> tuple[float, float]:
        """Powers of twist and bend with which the turn about an axis grows at one degree."""
        small = np.deg2rad(1.0)
        one, wide, bent = (parts(robot, manoeuvre(small * x, small * y), axis)[0] for x, y in ((1, 1), (2, 1), (1, 2)))
        return np.log2(wide / one), np.log2(bent / one)

    roll, roll_rest = parts(mirrored, FULL_A, 2)
    yaw, yaw_rest = parts(plain, FULL_B, 1)
    b_twist, b_bend = growth(robot, reojax.manoeuvre_b, 1)
    a_twist, a_bend = growth(robot, reojax.manoeuvre_a, 2)
    names = {"link_names": robot.link_names, "joint_names": robot.joint_names, "name": robot.name}
    cat = robots.two_cylinder_cat(0.25).replace(**names)  # one program for all
    cat_twist, cat_bend = growth(cat, reojax.manoeuvre_a, 2)
    return {
        "mirrored_a_deg": roll,
        "mirrored_a_off_axis_deg": roll_rest,
        "half_turn_b_deg": yaw,
        "half_turn_b_off_axis_deg": yaw_rest,
        "a_power_of_twist": a_twist,
        "a_power_of_bend": a_bend,
        "b_power_of_twist": b_twist,
        "b_power_of_bend": b_bend,
        "cat_a_power_of_twist": cat_twist,
        "cat_a_power_of_bend": cat_bend,
    }


def reach(grids: dict[str, Grid], *, targets: int) -> Numbers:
    """How near A, up to four times B and A come to uniformly random orientations (thesis 2.9).

    Each at full bend, forwards or backwards, twists as in `LINE`; rolls and yaws about a degree apart.
    """
    asked = Rotation.random(targets, rng=np.random.default_rng(SEED))
    a = _spread(grids["line_a"].turn, np.rad2deg(grids["line_a"].turn.roll))
    b = _spread(grids["line_b"].turn, np.abs(np.rad2deg(grids["line_b"].turn.yaw)))
    yaws = Rotation.concatenate([b**0, b, b**2, b**3, b**4])
    miss = _nearest(_products(yaws, a), a, asked)
    return {"targets": targets, "any_within_3_deg": _share(miss), "any_worst_deg": float(np.rad2deg(miss.max()))}


def _spread(turn: Turn, size: np.ndarray) -> Rotation:
    """Loops whose turns are about a degree apart, from none on, forwards and backwards."""
    wanted = np.arange(0, size.max() + 0.5, 1.0)
    chosen = np.argmin(np.abs(size - wanted[:, None]), axis=1)
    loops = np.asarray(turn.rotation)[chosen]
    return Rotation.from_matrix(np.concatenate([loops, loops.transpose(0, 2, 1)]))


def rectangles(targets: int = 2000) -> Numbers:
    """Share of uniformly random orientations within 3 degrees of one rectangle with free signs and amplitudes."""
    twist = np.linspace(-FULL_TWIST, FULL_TWIST, 38)  # an even number: not zero, as `last` divides by it
    bend = np.linspace(-FULL_BEND, FULL_BEND, 17)
    first, bent, second = (x.ravel() for x in np.meshgrid(twist, bend, twist, indexing="ij"))
    usual = {"inertia": END_INERTIA, "ratio": GEAR_RATIO, "rotor": ROTOR_INERTIA}
    columns = {"twist": first, "bend": bent, "last": second / first, **usual}
    one = Rotation.from_matrix(run({key: np.broadcast_to(x, first.shape) for key, x in columns.items()}).rotation)
    miss = _nearest(one, Rotation.identity(1), Rotation.random(targets, rng=np.random.default_rng(SEED)))
    return {"one_rectangle_within_3_deg": _share(miss)}


def _share(angle: np.ndarray) -> float:
    return float(np.mean(angle < np.deg2rad(3)))


def _products(first: Rotation, second: Rotation) -> Rotation:
    return Rotation.concatenate([one * second for one in first])


def _nearest(found: Rotation, before: Rotation, targets: Rotation) -> np.ndarray:
    """Angle from each target to the nearest product of one of `before` and one of `found` [rad]."""
    tree = KDTree(np.concatenate([found.as_quat(), -found.as_quat()]))
    asked = [(before.inv() * target).as_quat() for target in targets]
    chord = [tree.query(q, workers=-1)[0].min() for q in asked]
    return 4 * np.arcsin(np.minimum(np.array(chord) / 2, 1.0))


def history(rotations: np.ndarray) -> Numbers:
    """Figure 1.9: where the first and third ZXZ angle end, continued along A."""
    first, _, third = np.rad2deg(zxz_without_jumps(rotations)[-1])
    return {"a_first_zxz_deg": first, "a_third_zxz_deg": third}


def measure(grids: dict[str, Grid], rotations: np.ndarray, *, quick: bool) -> Numbers:
    """Measure what the claims are judged by, from sweeps and history of A; `quick` leaves out three parts."""
    robot = robots.prototype()
    parts = [amplitudes(grids), designs(grids), history(rotations), middle_links(robot), paths(robot), symmetric(robot)]
    parts += [reach(grids, targets=10 if quick else 100)]
    parts += [] if quick else [six_body(), rectangles(), motors(robot)]
    return {key: float(value) for part in parts for key, value in part.items()}
