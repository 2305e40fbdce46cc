"""The site's lessons as PDF files, printed by Chromium as the pages show them, with every answer unfolded."""

from collections.abc import Iterable
from pathlib import Path

CHROMIUM = "/usr/bin/chromium"


def print_pages(site: Path, pages: Iterable[str]) -> None:
    """Write PAGE.pdf beside each PAGE.html of a built site; pages as Sphinx names them."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        tab = browser.new_page(color_scheme="light")
        for page in pages:
            tab.goto((site / f"{page}.html").as_uri())
            tab.evaluate("document.querySelectorAll('details').forEach((fold) => (fold.open = true))")
            tab.evaluate("document.querySelectorAll('img').forEach((image) => (image.loading = 'eager'))")
            tab.wait_for_function("[...document.images].every((image) => image.complete)")
            tab.evaluate("window.MathJax?.startup?.promise")
            tab.pdf(path=site / f"{page}.pdf", format="A4", margin=dict.fromkeys(("top", "bottom"), "15mm"))
        browser.close()
