"""The pages that grading writes can be read in both schemes, and on a phone."""

import pytest
import report_pages

NAMES = ("feedback", "class", "alike", "course", "texts")
# The least contrast of a text with what is behind it, by WCAG's formula, and that text.
CONTRAST = """() => {
  const channel = c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  const parts = colour => colour.match(/[\\d.]+/g).map(Number);
  const luminance = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  const behind = e => { const [r, g, b, a = 1] = parts(getComputedStyle(e).backgroundColor);
                        return a ? [r, g, b] : e.parentElement ? behind(e.parentElement) : [255, 255, 255]; };
  let least = [Infinity, ""];
  for (const e of document.querySelectorAll("main, main *")) {
    if (![...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim())) continue;
    const [a, b] = [luminance(parts(getComputedStyle(e).color)), luminance(behind(e))].sort((x, y) => y - x);
    const found = (a + 0.05) / (b + 0.05);
    if (found < least[0]) least = [found, e.outerHTML.slice(0, 80)];
  }
  return [...least, luminance(behind(document.body))];
}"""


@pytest.mark.debian("chromium")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_has_contrast_in_its_scheme_and_fits_a_phone(page, tmp_path, scheme):
    page.emulate_media(color_scheme=scheme)
    files = report_pages.write_report_pages(tmp_path)
    assert tuple(files) == NAMES
    for name, file in files.items():
        page.goto(file.as_uri())
        page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
        least, where, ground = page.evaluate(CONTRAST)
        assert least >= 4.5, (name, least, where)
        assert (ground < 0.1) == (scheme == "dark"), (name, ground)
        for width in (1280, 390):
            page.set_viewport_size({"width": width, "height": 844})
            # What is wide scrolls in its own place, which keys reach, and nothing is cut.
            assert page.evaluate("document.documentElement.scrollWidth") <= width, name
            unreachable = "[...document.querySelectorAll('main *')].filter(e => e.scrollWidth > e.clientWidth + 1 && "
            unreachable += "['auto', 'scroll'].includes(getComputedStyle(e).overflowX) && e.tabIndex < 0).length"
            assert page.evaluate(unreachable) == 0, name
