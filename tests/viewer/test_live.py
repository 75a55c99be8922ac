"""Dragging joints turns the base as the momentum equation says; the live page answers on the loopback."""

import dataclasses
import time
import urllib.request
import warnings

import numpy as np
import pytest

import reojax
from reojax import robots
from reojax.viewer.dragging import Dragging

PROTOTYPE = robots.prototype()
LOOP = reojax.manoeuvre_a(np.deg2rad(90.0), np.deg2rad(60.0))


def test_many_small_moves_are_the_loop():
    """Whatever the pieces a drag comes in, the base ends where `net_rotation` of the whole way has it."""
    dragging = Dragging(PROTOTYPE)
    corners = np.asarray(LOOP.waypoints)
    for start, end in zip(corners[:-1], corners[1:], strict=True):
        for share in (0.1, 0.35, 1.0):
            dragging.move(start + share * (end - start))
    np.testing.assert_allclose(dragging.rotation, reojax.net_rotation(PROTOTYPE, LOOP), atol=1e-9)


def test_there_and_back_turns_nothing():
    dragging = Dragging(PROTOTYPE)
    dragging.move(np.array([0.7, -0.4, 1.1]))
    assert reojax.so3.angle(dragging.rotation) > 0.1
    dragging.move(np.zeros(3))
    np.testing.assert_allclose(dragging.rotation, np.eye(3), atol=1e-10)


def test_coupled_joints_follow():
    """A mimic joint goes as its driver says, whatever is asked of it."""
    coupled = dataclasses.replace(
        PROTOTYPE, couplings=((2, 0),), coupling_ratio=np.array([-2.0]), coupling_offset=np.array([0.1])
    )
    dragging = Dragging(coupled)
    dragging.move(np.array([0.3, 0.0, 9.0]))
    np.testing.assert_allclose(dragging.theta, [0.3, 0.0, -0.5])


@pytest.fixture(scope="module")
def live():
    pytest.importorskip("viser", reason="no viser: pip install reojax[viser]")
    from reojax.viewer.live import serve

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of viser and what it imports
        page = serve(PROTOTYPE, port=8765)
    yield page
    page.stop()


def test_answers_on_the_loopback_only(live):
    assert live.server.get_host() == "127.0.0.1"
    with urllib.request.urlopen(f"http://127.0.0.1:{live.server.get_port()}/", timeout=20) as answer:
        assert answer.status == 200


def test_dragging_turns_the_scene(live):
    """Frames of the page are those of the library, the base turned by `net_rotation`."""
    live.drag(1, 0.8)
    edge = reojax.polygon(np.array([[0.0, 0, 0], [0, 0.8, 0]]))
    turn = np.asarray(reojax.net_rotation(PROTOTYPE, edge))
    rotation, _ = reojax.link_poses(PROTOTYPE, np.array([0, 0.8, 0]))
    for frame, own in zip(live.frames, np.asarray(rotation), strict=True):
        np.testing.assert_allclose(reojax.so3.from_quaternion(np.array(frame.wxyz)), turn @ own, atol=1e-6)
    live.drag(1, 0.0)


def test_sliders_of_the_robot_run_a_and_b_again(live):
    """A heavier end, and the table and the robot that one drags are another one's at once."""
    before = live.turns.content
    live.inertia.value = 2 * live.inertia.value
    changed = robots.with_end_inertia(PROTOTYPE, live.inertia.value * 1e-6)
    loop = reojax.manoeuvre_a(np.deg2rad(270.0), np.deg2rad(120.0))
    angle = np.rad2deg(float(reojax.so3.angle(reojax.net_rotation(changed, loop))))
    assert live.turns.content != before
    assert f"| A | {angle:.2f}°" in live.turns.content
    np.testing.assert_allclose(live.dragging.robot.mass, changed.mass)


def test_slider_in_a_browser(live, browser):
    """A joint's number typed in a real page moves the robot here."""
    browser.get(f"http://127.0.0.1:{live.server.get_port()}/")
    deadline = time.time() + 60
    while len(fields := browser.find_elements("css selector", "input[inputmode]")) < 3 and time.time() < deadline:
        time.sleep(0.2)
    before = live.dragging.rotation
    fields[1].click()
    fields[1].send_keys("\ue003" * 8, "45", "\ue007")  # backspaces, and enter at the end
    while not np.isclose(live.dragging.theta[1], np.deg2rad(45)) and time.time() < deadline:
        time.sleep(0.1)  # each digit is a move
    assert live.dragging.theta[1] == pytest.approx(np.deg2rad(45), abs=1e-6)
    assert np.abs(live.dragging.rotation - before).max() > 0.1


def test_without_viser_it_says_what_to_install(monkeypatch):
    import builtins

    from reojax.viewer import live as module

    real = builtins.__import__

    def without(name, *rest):
        if name == "viser":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ValueError, match=r"pip install 'reojax\[viser\]'"):
        module.serve(PROTOTYPE)
