"""A real browser, headless."""

import shutil

import pytest


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window; tests that need it are skipped where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="no selenium: pip install reojax[test]")
    chrome = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
    driver = shutil.which("chromedriver")
    if chrome is None or driver is None:
        pytest.skip("no browser: the page is tested where chromium and chromedriver are installed")
    options = webdriver.ChromeOptions()
    options.binary_location = chrome
    for flag in (
        "headless=new no-sandbox use-gl=angle use-angle=swiftshader enable-unsafe-swiftshader no-first-run "
        "disable-background-networking disable-component-update disable-sync window-size=1280,900"
    ).split():
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    page = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield page
    page.quit()
