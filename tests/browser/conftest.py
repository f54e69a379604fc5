"""A browser and a running explorer; the tests fail where no browser is installed."""

import re
import shutil
import subprocess
import sys

import pytest
from playwright.sync_api import sync_playwright


def chromium():
    """The path of the system's Chromium."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    raise RuntimeError("the tests of the page need Chromium; on Debian: apt-get install chromium")


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def address(explored):
    command = [sys.executable, "-u", "-m", "sigdb", "explore", str(explored), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        found = re.match(r"http://127\.0\.0\.1:\d+/#token=\S+", server.stdout.readline())
        yield found.group()
        server.terminate()


@pytest.fixture
def page(browser, address):
    """A page that shows a view; a message on its console fails the test."""
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    complaints = []
    opened.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.goto(address)
    opened.wait_for_selector("body[data-painted]")
    yield opened
    opened.close()
    assert complaints == []
