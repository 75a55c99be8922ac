"""The page in a real browser, headless: it loads nothing, shows the poses that the library has, and obeys."""

import json
import time

import jax
import numpy as np
import pytest

import reojax
from reojax import robots

pytest.importorskip("selenium", reason="no selenium: pip install reojax[test]")
from selenium.webdriver.common.keys import Keys

pytestmark = pytest.mark.slow  # a browser
PROTOTYPE = robots.prototype()
LOOP = reojax.manoeuvre_a(np.deg2rad(270.0), np.deg2rad(120.0))
HALF_TURN = np.diag([-1.0, -1.0, 1.0])
NASTY = "</script><script>alert(1)</script>\"'`${1}&lt;<!--"


@pytest.fixture(scope="module")
def turn(tmp_path_factory):
    return reojax.view(PROTOTYPE, LOOP, tmp_path_factory.mktemp("page") / "turn.html", target=HALF_TURN)


def open_page(browser, file):
    browser.get_log("browser"), browser.get_log("performance")
    browser.get(file.as_uri())
    return browser


def poses(browser, sample, clip=0):
    shown = browser.execute_script("return window.reojax.poses(arguments[0], arguments[1])", sample, clip)
    links = shown["links"]
    return np.array(shown["base"]), np.array([x["rotation"] for x in links]), np.array([x["position"] for x in links])


def clock(browser):
    return browser.execute_script("return window.reojax.clock()")


def press(browser, *keys):
    body = browser.find_element("tag name", "body")
    for key in keys:
        body.send_keys(key)


def test_loads_without_complaint_and_without_a_request(browser, turn):
    """From disk, and nothing else is asked for; WebGL draws (the note that it is missing stays hidden)."""
    open_page(browser, turn)
    time.sleep(0.3)
    assert [entry for entry in browser.get_log("browser") if entry["level"] in ("WARNING", "SEVERE")] == []
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
    assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [turn.as_uri()]
    assert not browser.find_element("id", "missing").is_displayed()
    assert turn.stat().st_size < 1e6


def test_poses_are_those_of_the_library(browser, turn):
    """Read back from the scene: base as `rotation_history`, links as `link_poses` about the centre of mass."""
    open_page(browser, turn)
    samples = browser.execute_script("return window.reojax.samples()") - 1
    history = np.asarray(reojax.rotation_history(PROTOTYPE, LOOP, samples=samples // 4))
    place = jax.jit(lambda theta: (*reojax.link_poses(PROTOTYPE, theta), reojax.centre_of_mass(PROTOTYPE, theta)))
    for sample in (0, 1, samples // 3, samples // 2, samples):
        base, turned, at = poses(browser, sample)
        along = 4 * sample / samples
        theta = [np.interp(along, range(5), angles) for angles in np.asarray(LOOP.waypoints).T]
        rotation, position, centre = map(np.asarray, place(np.array(theta)))
        np.testing.assert_allclose(base, history[sample], atol=1e-6)
        np.testing.assert_allclose(turned, history[sample] @ rotation, atol=1e-6)
        np.testing.assert_allclose(at, (position - centre) @ history[sample].T, atol=1e-6)


def test_slider_moves_the_robot(browser, turn):
    """Dragging the slider to the end shows the net rotation."""
    open_page(browser, turn)
    slide = "const s = document.getElementById('slider'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))"
    before = poses(browser, None)[0]
    browser.execute_script(slide, 1)
    after = poses(browser, None)[0]
    np.testing.assert_allclose(before, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(after, reojax.net_rotation(PROTOTYPE, LOOP), atol=1e-6)


def test_keys(browser, turn):
    """Arrows step, home and end jump, + and - change the speed, space plays and stops."""
    open_page(browser, turn)
    press(browser, Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_LEFT)
    assert clock(browser) == pytest.approx(0.04)
    press(browser, Keys.END)
    assert clock(browser) == 4
    press(browser, Keys.HOME)
    assert clock(browser) == 0
    speed = "return window.reojax.speed()"
    press(browser, "+")
    assert browser.execute_script(speed) == 2
    press(browser, "-", "-")
    assert browser.execute_script(speed) == 0.5
    press(browser, Keys.SPACE)
    time.sleep(0.5)
    press(browser, Keys.SPACE)
    stopped = clock(browser)
    assert stopped > 0
    time.sleep(0.1)
    assert clock(browser) == stopped


def test_track_of_an_axis_can_be_chosen(browser, turn):
    open_page(browser, turn)
    chosen = "return [...document.querySelectorAll('#tools button')].map((b) => b.getAttribute('aria-pressed'))"
    assert browser.execute_script(chosen) == ["false", "true", "false"]  # y, whose tip goes farthest
    press(browser, "x")
    assert browser.execute_script(chosen) == ["true", "false", "false"]


def test_names_stay_text(browser, tmp_path):
    """A robot, a joint, a link and a title that look like markup are shown letter by letter and run nothing."""
    joints = (NASTY, *PROTOTYPE.joint_names[1:])
    robot = PROTOTYPE.replace(name=NASTY, joint_names=joints, link_names=(NASTY, *PROTOTYPE.link_names[1:]))
    file = reojax.view(robot, LOOP, tmp_path / "nasty.html", title=NASTY, names=[NASTY], rows={NASTY: NASTY})
    open_page(browser, file)
    assert browser.title == NASTY
    assert browser.find_element("id", "title").text == NASTY
    assert browser.find_element("id", "curves").text.count(NASTY) == 1
    assert browser.find_element("id", "numbers").text.count(NASTY) == 2
    assert len(browser.find_elements("tag name", "script")) == 3
    assert [entry for entry in browser.get_log("browser") if entry["level"] in ("WARNING", "SEVERE")] == []


@pytest.mark.parametrize("size", [(360, 640), (768, 1024), (1280, 800)], ids=["telephone", "tablet", "desk"])
def test_fits_the_screen(browser, turn, size):
    """Nothing sticks out to the side, the controls are on the screen, and targets for fingers are large enough."""
    open_page(browser, turn)
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size[0] < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        wide, high = browser.execute_script("return [document.documentElement.scrollWidth, innerHeight]")
        play = browser.find_element("id", "play").rect
        top = browser.execute_script("return document.getElementById('play').getBoundingClientRect().top")
        assert wide <= size[0]
        assert 0 <= top <= high - play["height"]
        assert min(play["height"], play["width"]) >= 36
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_ghost_and_second_motion_share_the_clock(browser, tmp_path):
    """Three motions of different lengths: each is where it is at that time, and waits at its end."""
    other = reojax.manoeuvre_b(np.deg2rad(90.0), np.deg2rad(60.0))
    motions = [
        reojax.simulate(PROTOTYPE, path, durations=np.full(4, s), samples=16)
        for path, s in ((LOOP, 0.1), (other, 0.2), (LOOP, 0.15))
    ]
    file = reojax.view(PROTOTYPE, motions[0], tmp_path / "three.html", beside=motions[1], ghost=motions[2])
    open_page(browser, file)
    browser.execute_script("window.reojax.poses(window.reojax.samples(1) - 1, 1)")  # after 0.8 s
    for clip, motion in enumerate(motions):
        np.testing.assert_allclose(poses(browser, None, clip)[0], motion.rotation[-1], atol=1e-6)
    assert browser.execute_script("return window.reojax.clock()") == pytest.approx(0.8)


def test_the_nearest_points_are_as_far_apart_as_the_library_says(browser, tmp_path):
    """Where manoeuvre B meets itself the two points of the surfaces are past each other by the depth of the contact."""
    meeting = reojax.manoeuvre_b(np.deg2rad(-270.0), np.deg2rad(120.0))
    near = reojax.nearest_parts(PROTOTYPE, meeting)
    open_page(browser, reojax.view(PROTOTYPE, meeting, tmp_path / "meeting.html", clearance=True))
    gaps = [
        (poses(browser, sample), browser.execute_script("return window.reojax.gap()"))[1]
        for sample in range(int(64 * near.at), int(64 * near.at) + 2)
    ]
    share = 64 * near.at % 1
    assert abs((1 - share) * gaps[0] + share * gaps[1] + near.found) < 1e-3
    assert "mm deep in contact" in browser.find_element("id", "caption").text
