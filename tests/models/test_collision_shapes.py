"""Capsules from files contain what they stand for, and say how much more they hold."""

import numpy as np
import pytest

from reojax import load_robot
from reojax.models import capsule_fit

RNG = np.random.default_rng(0)


def depth(points: np.ndarray, fits) -> np.ndarray:
    """How far each point lies outside of the nearest capsule (negative: inside)."""
    out = np.full(len(points), np.inf)
    for fit in fits:
        along = fit.end - fit.start
        share = np.clip((points - fit.start) @ along / max(along @ along, 1e-300), 0, 1)
        out = np.minimum(out, np.linalg.norm(points - fit.start - share[:, None] * along, axis=1) - fit.radius)
    return out


@pytest.mark.parametrize(("radius", "half"), [(0.1, 0.5), (0.1, 0.1), (0.5, 0.01), (1e-3, 1.0)])
def test_a_capsule_contains_its_cylinder(radius, half):
    """The rims; and it is not larger than the plain choice, ends at the faces."""
    turn = np.linspace(0, 2 * np.pi, 50)
    rims = np.array([(radius * np.cos(t), radius * np.sin(t), s * half) for t in turn for s in (-1, 1)])
    fit = capsule_fit.around_cylinder(radius, half)
    assert depth(rims, [fit]).max() <= 1e-15
    plain = np.pi * radius**2 * (2 * half + 4 / 3 * radius)
    assert fit.volume <= plain * (1 + 1e-9)


@pytest.mark.parametrize("half", [(0.1, 0.1, 0.1), (0.5, 0.1, 0.1), (0.5, 0.4, 0.02), (0.02, 0.5, 0.4)])
def test_capsules_contain_their_box(half):
    points = RNG.uniform(-1, 1, (4000, 3)) * half
    points = np.vstack([points, [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)] * np.array(half)])
    fits = capsule_fit.around_box(np.array(half))
    assert depth(points, fits).max() <= 1e-12
    assert (len(fits) > 1) == (min(half) < 0.1)


@pytest.mark.parametrize("half", [(0.3, 0.2, 0.1), (0.1, 0.2, 0.2), (0.2, 0.2, 0.2)])
def test_a_capsule_contains_its_ellipsoid(half):
    points = RNG.normal(size=(4000, 3))
    points *= np.array(half) / np.linalg.norm(points, axis=1, keepdims=True)
    assert depth(points, [capsule_fit.around_ellipsoid(np.array(half))]).max() <= 1e-15


def test_capsules_contain_random_clouds_tightly():
    """A turned, stretched cloud: all points inside, at most 2.5 times its hull."""
    for _ in range(5):
        cloud = RNG.uniform(-1, 1, (200, 3)) * (1, 0.2, 0.25) @ np.linalg.qr(RNG.normal(size=(3, 3)))[0]
        fit = capsule_fit.around_points(cloud)
        assert depth(cloud, [fit]).max() <= 1e-12
        assert fit.volume < 2.5 * capsule_fit.hull_volume(cloud)


def test_an_l_of_two_bars_gets_more_than_one_capsule():
    trimesh = pytest.importorskip("trimesh")
    bars = [trimesh.creation.box((1, 0.1, 0.1)), trimesh.creation.box((0.1, 1, 0.1))]
    bars[0].apply_translation((0.5, 0, 0))
    bars[1].apply_translation((0, 0.5, 0))
    mesh = trimesh.util.concatenate([bar.subdivide().subdivide() for bar in bars])
    fits = capsule_fit.around_mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    assert len(fits) > 1
    surface = mesh.triangles.mean(1)
    assert depth(np.vstack([surface, mesh.vertices]), fits).max() <= 1e-12


INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def load(tmp_path, geometry: str, **options):
    shape = f'<collision><origin xyz="0 0 1" rpy="0 1.5707963267948966 0"/><geometry>{geometry}</geometry></collision>'
    (tmp_path / "robot.urdf").write_text(f'<robot name="r"><link name="a">{INERTIAL}{shape}</link></robot>')
    return load_robot(tmp_path / "robot.urdf", **options)


def test_shapes_of_urdf(tmp_path):
    """A sphere as it is; a capsule too, turned a quarter about y: z to x."""
    (sphere,) = load(tmp_path, '<sphere radius="0.2"/>').capsules
    np.testing.assert_array_equal(sphere.start, [0, 0, 1])
    assert sphere.radius == 0.2
    (capsule,) = load(tmp_path, '<capsule radius="0.2" length="1"/>').capsules
    np.testing.assert_allclose(capsule.end, [0.5, 0, 1], atol=1e-15)
    robot = load(tmp_path, '<box size="1 0.2 0.2"/>')
    assert any(
        "their volume over that of the shapes' hulls: a 1." in note or "hulls: a 2" in note for note in robot.notes
    )
    assert not load(tmp_path, '<box size="1 0.2 0.2"/>', shapes=False).capsules


@pytest.mark.parametrize(
    ("geometry", "reason"),
    [
        ('<mesh filename="package://pack/none.stl"/>', "mesh not beside the file"),
        ('<mesh filename="http://example.org/mesh.stl"/>', "only files are read"),
        ('<mesh filename="/etc/hostname"/>', "mesh not beside the file"),
        ('<mesh filename="../../../../../../etc/hostname"/>', "mesh not beside the file"),
        ('<mesh filename="bad.stl"/>', "cannot be read|without vertices"),
        ('<box size="0 1 1"/>', "without extent"),
        ('<sphere radius="x"/>', "radius is 'x'"),
        ("<teapot/>", "no capsule contains a teapot"),
    ],
)
def test_shapes_that_cannot_be_read_are_told_and_left_out(tmp_path, geometry, reason):
    import re

    pytest.importorskip("trimesh")
    (tmp_path / "bad.stl").write_text("no mesh")
    robot = load(tmp_path, geometry)
    assert not robot.capsules
    assert any(re.search(reason, note) for note in robot.notes)


def test_meshes_of_a_package_are_found_beside_the_file(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    (tmp_path / "pack" / "meshes").mkdir(parents=True)
    (tmp_path / "pack" / "urdf").mkdir()
    trimesh.creation.cylinder(0.1, 1.0).export(tmp_path / "pack" / "meshes" / "rod.stl")
    for name in ("package://pack/meshes/rod.stl", "../meshes/rod.stl"):
        robot = load(tmp_path / "pack" / "urdf", f'<mesh filename="{name}" scale="2 2 2"/>')
        (capsule,) = robot.capsules
        assert 0.2 <= capsule.radius < 0.25
        np.testing.assert_allclose(np.abs(np.subtract(capsule.start, capsule.end)).max(), 2, atol=0.35)


def test_a_shape_of_no_size_that_can_be_meant_is_left_out(tmp_path):
    """Its volume would be no number."""
    pytest.importorskip("mujoco")
    from fuzz.damage import MJCF

    file = tmp_path / "r.xml"
    file.write_text(MJCF.replace('size="0.1 0.2"', 'size="1e308 0.2"'))
    robot = load_robot(file)
    assert not robot.capsules
    assert any("larger than" in note for note in robot.notes)
