"""Clearance at a posture: distances of capsules against another library's, derivatives, shapes of the named robots."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import reojax
from reojax import Capsule
from reojax.collision.clearance import clearances, pair_name
from reojax.collision.segments import segment_distance

RNG = np.random.default_rng(19)


def arm(joints=4, capsules=12, seed=0):
    """Serial or branched robot with random capsules, spheres among them."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=(joints, 3))
    shapes = []
    for i in range(capsules):
        start = rng.uniform(-0.3, 0.3, 3)
        end = start if i % 4 == 0 else rng.uniform(-0.3, 0.3, 3)
        shapes.append(Capsule(i % (joints + 1), start, end, rng.uniform(0.01, 0.05)))
    pairs = [
        (a, b) for a in range(capsules) for b in range(a + 1, capsules) if shapes[a].link != shapes[b].link
    ]  # fmt: skip
    return reojax.make_robot(
        mass=np.ones(joints + 1),
        com=np.zeros((joints + 1, 3)),
        inertia=np.tile(np.eye(3) * 1e-2, (joints + 1, 1, 1)),
        axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        anchor=rng.uniform(-0.5, 0.5, (joints, 3)),
        parent=[0, 1, 1, 3, 0][:joints],
        capsules=shapes,
        collision_pairs=pairs,
    )


def test_distances_are_those_of_coal():
    """Random capsules and spheres of a branched robot at random postures, to 1e-10 m; poses by `link_poses`."""
    coal = pytest.importorskip("coal")
    robot = arm()
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-14
    worst = 0.0
    clearance, link_poses = jax.jit(reojax.clearance), jax.jit(reojax.link_poses)
    for theta in RNG.uniform(-3, 3, (8, robot.joints)):
        rotation, position = map(np.asarray, link_poses(robot, theta))
        found = np.asarray(clearance(robot, theta))

        def place(number, rotation=rotation, position=position):
            link, start, end, radius = robot.capsules[number]
            middle, along = 0.5 * (start + end), np.asarray(end) - start
            length = np.linalg.norm(along)
            z = along / length if length else np.array([0.0, 0, 1])
            x = np.linalg.svd(z[None])[2][1]
            frame = np.stack([x, np.cross(z, x), z], 1)
            pose = coal.Transform3s(rotation[link] @ frame, position[link] + rotation[link] @ middle)
            return (coal.Capsule(radius, length) if length else coal.Sphere(radius)), pose

        for pair, here in zip(robot.collision_pairs, found, strict=True):
            (one, at), (other, there) = place(pair[0]), place(pair[1])
            theirs = coal.distance(one, at, other, there, request, coal.DistanceResult())
            worst = max(worst, abs(here - theirs)) if theirs > 0 else worst
            assert (here > 0) == (theirs > 0) or abs(here) < 1e-9
    assert worst < 1e-10


@pytest.mark.parametrize(
    "robot", [arm(seed=5), reojax.robots.satellite_arm(), reojax.robots.astronaut()], ids=lambda r: r.name
)
def test_distances_are_those_of_mujoco(robot, tmp_path):
    """MuJoCo places the capsules of a file that `write_mjcf` wrote by its own kinematics; overlaps too, to 1e-10 m."""
    mujoco = pytest.importorskip("mujoco")
    reojax.write_mjcf(robot, tmp_path / "robot.xml", rotors=False)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data, rng = mujoco.MjData(model), np.random.default_rng(2)
    body = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) for name in robot.link_names]
    geoms = {k: list(np.flatnonzero(model.geom_bodyid == b)) for k, b in enumerate(body)}
    geom = [geoms[link].pop(0) for link in robot.capsule_link]
    where = [model.joint(name).qposadr[0] for name in robot.joint_names]
    clearance, met = jax.jit(reojax.clearance), False
    for theta in rng.uniform(-2, 2, (20, robot.joints)):
        data.qpos[where] = theta
        mujoco.mj_forward(model, data)
        theirs = [mujoco.mj_geomDistance(model, data, geom[a], geom[b], 1e3, None) for a, b in robot.collision_pairs]
        np.testing.assert_allclose(clearance(robot, theta), theirs, rtol=0, atol=1e-10)
        met |= min(theirs) < 0
    assert met or robot.name == "satellite_arm"  # whose arm hardly reaches its bus


def awkward(rng, count=400):
    """Segments (4, 3, n) that are parallel, on one line, without length, touching or crossing, and any."""
    p = rng.normal(size=(4, 3, count))
    k = count // 8
    p[1, :, :k] = p[0, :, :k]
    p[3, :, k // 2 : k + k // 2] = p[2, :, k // 2 : k + k // 2]
    parallel = slice(2 * k, 3 * k)
    p[3, :, parallel] = p[2, :, parallel] + rng.choice([1.7, -0.4], k) * (p[1] - p[0])[:, parallel]
    line = slice(3 * k, 4 * k)
    p[2, :, line] = p[0, :, line] + rng.uniform(-2, 2, k) * (p[1] - p[0])[:, line]
    p[3, :, line] = p[0, :, line] + rng.uniform(-2, 2, k) * (p[1] - p[0])[:, line]
    crossing = slice(4 * k, 5 * k)
    middle = p[0, :, crossing] + rng.uniform(0, 1, k) * (p[1] - p[0])[:, crossing]
    p[3, :, crossing] = middle + rng.uniform(0, 1, k) * (middle - p[2, :, crossing])
    p[2, :, 5 * k : 6 * k] = p[1, :, 5 * k : 6 * k]
    return p


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_segments_in_every_position(dtype):
    """Distances are the least of the quadratic over the unit square (active sets), crossing ones 0; both dtypes."""
    p = awkward(np.random.default_rng(3)).astype(dtype)
    found = jax.jit(segment_distance)(*p)
    assert found.dtype == dtype
    grid = np.linspace(0, 1, 201)
    p = p.astype(float)
    for i in range(p.shape[2]):
        a0, a1, b0, b1 = p[:, :, i]
        line = a0 + grid[:, None] * (a1 - a0)
        v = b1 - b0
        t = np.clip((line - b0) @ v / (v @ v if v.any() else 1), 0, 1)
        sampled = np.linalg.norm(line - b0 - t[:, None] * v, axis=1).min()
        assert found[i] <= sampled + 5e-6
        assert found[i] >= sampled - 0.5 * np.linalg.norm(a1 - a0) / 200 - 5e-6
    exact = slice(4 * (p.shape[2] // 8), 6 * (p.shape[2] // 8))  # crossing, then end on end
    assert np.abs(found[exact]).max() < (1e-7 if dtype == np.float64 else 1e-3)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_no_derivative_is_nan(dtype):
    """Forward, reverse and second derivatives are finite at parallel, touching, crossing and pointlike segments."""
    p = jnp.asarray(awkward(np.random.default_rng(4), 80), dtype)

    def total(p):
        return segment_distance(*p).sum()

    for derivative in (jax.grad, jax.jacfwd, lambda f: jax.jacfwd(jax.grad(lambda p: f(p)))):
        assert np.isfinite(np.asarray(jax.jit(derivative(total))(p[:, :, ::5]))).all()


def test_gradient_and_hessian_are_those_of_differences():
    """Of every pair of the branched robot, by the joints and by the shapes themselves."""
    robot = arm(capsules=7)
    theta = RNG.uniform(-1, 1, robot.joints)
    d, h = RNG.normal(size=robot.joints), 1e-5

    clearance = jax.jit(reojax.clearance)
    slope = jax.jit(lambda theta: jax.jvp(lambda x: reojax.clearance(robot, x), (theta,), (d,))[1])
    numeric = (clearance(robot, theta + h * d) - clearance(robot, theta - h * d)) / (2 * h)
    np.testing.assert_allclose(slope(theta), numeric, atol=1e-8)
    second = jax.jit(jax.jacfwd(lambda t: slope(theta + t * d)))(0.0)
    np.testing.assert_allclose(second, (slope(theta + h * d) - slope(theta - h * d)) / (2 * h), atol=1e-6)

    by_robot = jax.jit(jax.grad(lambda robot: reojax.clearance(robot, theta).sum()))(robot)
    for field in ("capsule_radius", "capsule_end", "anchor"):
        value = getattr(robot, field)
        change = RNG.normal(size=value.shape)
        if field == "capsule_end":  # a sphere that grows into a capsule has a kink
            change[(value == robot.capsule_start).all(1)] = 0
        ends = [clearance(robot.replace(**{field: value + s * h * change}), theta).sum() for s in (1, -1)]
        np.testing.assert_allclose((getattr(by_robot, field) * change).sum(), (ends[0] - ends[1]) / (2 * h), atol=1e-6)


def test_many_postures_at_once_and_float32():
    """`clearances` are those of single postures; float32 in, float32 out."""
    robot = reojax.robots.prototype()
    thetas = RNG.uniform(-2, 2, (5, 3))
    many = clearances(robot, thetas)
    single = jax.vmap(lambda theta: reojax.clearance(robot, theta))(thetas)
    np.testing.assert_allclose(many.T, single, atol=1e-15)
    low = reojax.clearance(robot, thetas[0].astype(np.float32))
    assert low.dtype == np.float32
    np.testing.assert_allclose(low, single[0], atol=1e-6)


@pytest.mark.parametrize("name", reojax.robots.NAMES)
def test_named_robots_are_clear_at_rest(name):
    """Every named robot has shapes, pairs of them that are clear at rest, none of links that are joined."""
    robot = reojax.robots.by_name(name)
    assert robot.capsules
    assert (reojax.clearance(robot, np.zeros(robot.joints)) > 0).all()
    for a, b in robot.collision_pairs:
        first, second = robot.capsule_link[a], robot.capsule_link[b]
        assert first != second
        assert robot.parent[max(first, second) - 1] != min(first, second)


def test_prototype_capsules_contain_its_parts():
    """The corners of the steel inserts and the rims of the middle cylinders lie within the shapes."""
    from reojax.robots.prototype import Chosen

    robot, chosen = reojax.robots.prototype(), Chosen()
    foot = robot.capsules[1]
    heel, tip = np.asarray(foot.start), np.asarray(foot.end)
    along = (tip - heel) / np.linalg.norm(tip - heel)
    frame = np.stack([along, np.cross(along, [0, 0, 1.0]), [0, 0, 1.0]])
    corners = tip + 0.5 * chosen.insert_side * np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T @ frame
    ball = robot.capsules[2]
    assert np.linalg.norm(corners - ball.start, axis=1).max() <= ball.radius * (1 + 1e-12)
    middle = robot.capsules[3]
    assert middle.radius == chosen.middle_radius
    np.testing.assert_allclose(middle.end, robot.anchor[1])


def test_what_touches_at_rest_is_told():
    """The cat's halves always touch at the waist, which is said and is no pair."""
    robot = reojax.robots.two_cylinder_cat(0.25)
    assert any("'front' and 'rear'" in note and "touches at rest" in note for note in robot.notes)
    assert pair_name(robot, 0) == "front (capsule 0) and rear (capsule 3)"


def test_a_robot_without_pairs_has_no_distances():
    assert reojax.clearance(reojax.robots.planar(2), [0.3]).shape == (0,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": -0.1}, r"capsules\[0\].radius is -0.1"),
        ({"radius": 0.0}, r"capsules\[0\].radius is 0.0"),
        ({"link": "tail"}, r"capsules\[0\].link is 'tail'; the links are link0, link1"),
        ({"link": 2}, r"capsules\[0\].link is 2"),
        ({"start": [0.0, np.nan, 0.0]}, r"capsules\[0\].start"),
    ],
)
def test_shapes_that_make_no_sense_are_refused(change, message):
    good = Capsule(0, np.zeros(3), np.ones(3), 0.1)
    with pytest.raises(ValueError, match=message):
        reojax.make_robot(
            mass=[1, 1],
            com=np.zeros((2, 3)),
            inertia=[np.eye(3)] * 2,
            axis=[[0, 0, 1]],
            anchor=np.zeros((1, 3)),
            capsules=[good._replace(**change)],
        )


def test_postures_that_make_no_sense_are_refused():
    with pytest.raises(ValueError, match="`theta` has shape"):
        reojax.clearance(reojax.robots.prototype(), [0.0])
    with pytest.raises(ValueError, match="finite"):
        reojax.clearance(reojax.robots.prototype(), [0.0, np.inf, 0.0])
