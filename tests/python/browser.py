"""Pages in Chromium without a window, for tests of ``report.html``."""

import io
import shutil
import time
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

webdriver = pytest.importorskip("selenium.webdriver")
NEEDED = pytest.mark.skipif(
    not (shutil.which("chromedriver") and shutil.which("chromium")), reason="needs chromium and chromium-driver"
)
ARGUMENTS = ("headless=new", "no-sandbox", "disable-dev-shm-usage", "disable-gpu", "window-size=1300,1000")


@contextmanager
def started():
    """A browser that keeps what pages write to its console."""
    options = webdriver.ChromeOptions()
    for argument in ARGUMENTS:
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.chrome.service.Service(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def open_page(browser, page):
    browser.get(page.as_uri())
    end = time.monotonic() + 20
    while not browser.execute_script("return Boolean(window.page)") and time.monotonic() < end:
        time.sleep(0.05)


def move_slider(browser, frame):
    browser.execute_script(
        "const s = document.getElementById('time'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))", frame
    )


def picture(browser):
    return np.asarray(Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB"))


def number_of_colours(shown):
    """How many colours a picture (height, width, 3) has."""
    red, green, blue = np.moveaxis(shown.astype(np.uint32), -1, 0)
    return np.unique(red << 16 | green << 8 | blue).size  # of whole numbers: rows of three take a second
