"""A browser for the tests that look at pages: Debian's Chromium, driven by Playwright."""

import os
import shutil

import pytest

PATIENCE_MS = 150_000  # a kernel that imports torch on a busy machine takes its time


@pytest.fixture(scope="module")
def browser():
    """One Chromium without a window."""
    from playwright.sync_api import sync_playwright

    options = ["--no-sandbox", "--disable-dev-shm-usage"] if os.geteuid() == 0 else ["--disable-dev-shm-usage"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), headless=True, args=options)
        yield browser
        browser.close()


@pytest.fixture
def page(browser, tmp_path):
    """A page that remembers the errors of its console in `page.errors`, and leaves a picture of how it ended."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.errors = []
    page.on("console", lambda message: page.errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    yield page
    page.screenshot(path=tmp_path / "end.png")
    context.close()
