"""A report in a browser: as wide as the screen, all pictures there, words that can be read."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
# `make test` installs Chromium, which takes root; elsewhere these tests are shown as skipped, with
# the command.
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None,
    reason="chromium not installed: run `make chromium` as root or with sudo",
)
pytestmark = needs_chromium
CARD = Path(__file__).resolve().parents[2] / "cards" / "coarse_sand.html"
WIDTHS = (390, 900, 1600)
MOST_SHEETS = 14
LEAST_CONTRAST = 4.5  # of text to its ground, WCAG 2 AA
PROBE = """<script>
window.addEventListener("load", () => {
  const style = e => getComputedStyle(e), name = e => e.tagName + "." + e.className;
  const numbers = c => (c.match(/[0-9.]+/g) || [0, 0, 0, 0]).map(Number);
  const light = v => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const bright = c => { const l = numbers(c).map(v => light(v / 255));
    return 0.2126 * l[0] + 0.7152 * l[1] + 0.0722 * l[2]; };
  const ground = e => { for (; e; e = e.parentElement) {
    const c = style(e).backgroundColor, n = numbers(c);
    if (n.length < 4 || n[3] > 0) return c; } return "rgb(255, 255, 255)"; };
  const ratio = e => { const a = bright(style(e).color), b = bright(ground(e));
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05); };
  const texts = [...document.querySelectorAll("main *, nav *")].filter(e =>
    [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim()));
  const worst = texts.map(e => [ratio(e), name(e)]).sort((a, b) => a[0] - b[0])[0];
  const scrolls = e => { for (; e; e = e.parentElement)
    if (["auto", "scroll"].includes(style(e).overflowX)) return true; return false; };
  const wide = [...document.querySelectorAll("body *")].filter(e =>
    e.getBoundingClientRect().right > innerWidth + 1 && !scrolls(e)).map(name);
  parent.postMessage(JSON.stringify({width: innerWidth, wide: wide, worst: worst,
    page: document.documentElement.scrollWidth, texts: texts.length,
    images: [...document.images].map(i => i.naturalWidth),
    dark: matchMedia("(prefers-color-scheme: dark)").matches}), "*");
});</script>"""
FRAME = """<!DOCTYPE html><meta charset="utf-8"><body style="margin:0"><pre id="probe"></pre>
<script>
addEventListener("message", e => document.getElementById("probe").textContent = e.data);
</script><iframe src="%s" style="border:0;width:%dpx;height:1000px"></iframe></body>"""


def looked_at(page, folder, width, *options):
    """What a browser says of a page, and what it logged.

    The page is in a frame, as no window of a browser is as narrow as a telephone.
    """
    (folder / "page.html").write_text(page.replace("</body>", PROBE + "</body>"))
    (folder / "frame.html").write_text(FRAME % ("page.html", width))
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    command += ["--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}", *options]
    command += ["--window-size=1700,1200", "--virtual-time-budget=5000"]
    done = subprocess.run(
        [*command, f"file://{folder / 'frame.html'}"], capture_output=True, text=True, timeout=120
    )
    found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found and found.group(1), done.stderr[-2000:]
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return json.loads(found.group(1)), said


@pytest.fixture(params=["whole", "named"])
def page(request):
    """The page of a calibration, and that of a diagnosis."""
    return request.getfixturevalue(request.param)[2]


@pytest.mark.parametrize("width", WIDTHS)
def test_a_page_fits_the_screen_and_can_be_read(page, tmp_path, width):
    found, said = looked_at(page, tmp_path, width)
    assert found["width"] == width
    assert found["page"] <= width and not found["wide"]
    assert found["images"] and all(found["images"])
    assert found["texts"] > 100 and found["worst"][0] >= LEAST_CONTRAST
    assert not said


def test_a_page_can_be_read_in_the_dark(page, tmp_path):
    dark = "--blink-settings=preferredColorScheme=0"
    found, _ = looked_at(page, tmp_path, 900, "--force-dark-mode", dark)
    assert found["dark"] and found["worst"][0] >= LEAST_CONTRAST


def test_a_page_is_printed_on_few_sheets(page, tmp_path):
    (tmp_path / "page.html").write_text(page)
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", f"--print-to-pdf={tmp_path / 'p.pdf'}"]
    subprocess.run([*command, f"file://{tmp_path / 'page.html'}"], capture_output=True, timeout=120)
    sheets = (tmp_path / "p.pdf").read_bytes().count(b"/Type /Page\n")
    assert 1 <= sheets <= MOST_SHEETS


def test_a_material_card_fits_a_telephone(tmp_path):
    found, said = looked_at(CARD.read_text(), tmp_path, 390)
    assert found["page"] <= 390 and not found["wide"] and not said
    assert found["worst"][0] >= LEAST_CONTRAST


def test_the_probe_sees_what_is_too_wide_or_too_pale(tmp_path):
    wide = '<main><p style="width:2000px;color:#aaa">word</p><img src="data:,"></main>'
    found, _ = looked_at(f"<html><body>{wide}</body></html>", tmp_path, 900)
    assert found["wide"] and found["page"] > 900
    assert found["worst"][0] < LEAST_CONTRAST and not all(found["images"])
