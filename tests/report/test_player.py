"""The page in a real browser: it draws, plays, and asks the network for nothing."""

import pytest
from browser import Browser, find_chromium

from vrdp_prob.report import write_report

pytestmark = pytest.mark.browser

PLAYER = "document.getElementById('player')"
PIXELS = """(() => {
  const shown = document.querySelector('#player canvas');
  const canvas = Object.assign(document.createElement('canvas'), {width: shown.width, height: shown.height});
  const context = canvas.getContext('2d', {willReadFrequently: true});
  context.drawImage(shown, 0, 0);
  const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0;
  const colors = new Set();
  for (let i = 0; i < data.length; i += 4) {
    sum = (31 * sum + data[i] + 7 * data[i + 1] + 49 * data[i + 2]) % 2147483647;
    colors.add(data[i] * 65536 + data[i + 1] * 256 + data[i + 2]);
  }
  return [sum, colors.size];
})()"""


def part(name):
    return f"document.querySelector('#player [data-part={name}]')"


@pytest.fixture(scope="module")
def chromium():
    executable = find_chromium()
    if executable is None:
        pytest.skip("no Chromium is installed (chromium, chromium-browser, google-chrome or chrome)")
    return executable


@pytest.fixture(scope="module")
def browser(chromium, tmp_path_factory):
    with Browser(chromium, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture(scope="module")
def page(content, tmp_path_factory):
    return write_report(content, tmp_path_factory.mktemp("report")).page


@pytest.fixture
def opened(browser, page):
    browser.problems.clear()
    browser.requests.clear()
    browser.size(1280, 900)
    browser.open(page)
    yield browser
    assert browser.problems == []
    assert all(request.startswith(("data:", page.as_uri())) for request in browser.requests)


def set_value(browser, name, value, event):
    browser.run(f"{part(name)}.value = '{value}'; {part(name)}.dispatchEvent(new Event('{event}', {{bubbles: true}}))")


def test_canvas_is_drawn(opened):
    _, colors = opened.run(PIXELS)
    assert colors > 50


def test_time_label_follows_the_slider(opened):
    set_value(opened, "time", 2.4, "input")
    assert opened.run(f"{part('label')}.textContent") == "2.40 s · frame 60"
    before = opened.run(PIXELS)
    set_value(opened, "time", 3.2, "input")
    assert opened.run(f"{part('label')}.textContent") == "3.20 s · frame 80"
    assert opened.run(PIXELS) != before


def test_worlds_differ(opened):
    pictures = set()
    for key in ("factual", "removed:1", "heavier:2", "lighter:2"):
        set_value(opened, "world", key, "change")
        opened.wait(f"{part('canvas')}.getAttribute('aria-label').startsWith({part('world')}.selectedOptions[0].text)")
        pictures.add(tuple(opened.run(PIXELS)))
    assert len(pictures) == 4


def test_future_is_marked_as_predicted(opened):
    set_value(opened, "world", "future", "change")
    opened.wait(f"{part('time')}.max > 7")
    set_value(opened, "time", 7, "input")
    assert opened.run(f"{part('label')}.textContent") == "7.00 s · frame 175 · predicted"


def test_question_leads_to_its_world(opened):
    opened.run("document.querySelector('.jump[data-world=\"removed:1\"]').click()")
    opened.wait(f"{part('world')}.value === 'removed:1'")
    opened.wait(f"{part('play')}.textContent === 'Pause'")
    assert (
        opened.run("document.querySelector('.jump[data-world=\"removed:1\"]').getAttribute('aria-pressed')") == "true"
    )


def test_plays_to_the_end(opened):
    set_value(opened, "time", 4.9, "input")
    opened.run(f"{part('play')}.click()")
    opened.wait(f"{part('play')}.textContent === 'Play' && {part('label')}.textContent.startsWith('5.08')")


def test_keys_move_time(opened):
    set_value(opened, "time", 2, "input")
    opened.run(f"{part('canvas')}.focus()")
    opened.press("ArrowRight", 39)
    assert opened.run(f"{part('label')}.textContent") == "2.04 s · frame 51"
    opened.press(" ", 32)
    opened.wait(f"{part('play')}.textContent === 'Pause'")
    opened.press(" ", 32)
    opened.wait(f"{part('play')}.textContent === 'Play'")
    opened.press("Home", 36)
    assert opened.run(f"{part('label')}.textContent") == "0.00 s · frame 0"


def test_view_from_above_differs(opened):
    before = opened.run(PIXELS)
    opened.run("document.querySelector('#player [value=plane]').click()")
    sum_above, colors = opened.run(PIXELS)
    assert sum_above != before[0]
    assert colors > 20


def test_video_shows_under_the_rollouts_where_there_is_one(opened):
    set_value(opened, "time", 2, "input")
    opened.wait("new Promise((done) => setTimeout(() => done(true), 200))")
    with_video = opened.run(PIXELS)
    opened.run(f"{part('film')}.click()")
    assert opened.run(PIXELS) != with_video
    set_value(opened, "world", "removed:1", "change")
    opened.wait(f"{part('canvas')}.ariaLabel.startsWith('Without')")
    without_video = opened.run(PIXELS)
    opened.run(f"{part('film')}.click()")
    assert opened.run(PIXELS) == without_video


def test_collisions_are_listed_and_lead_to_their_time(opened):
    rows = opened.run("[...document.querySelectorAll('.pairs button')].map((row) => row.ariaLabel)")
    assert rows == [
        "gray cylinder and cyan sphere collide with probability > 93 %, at about 2.4 s; go there",
        "purple cube and gray cylinder collide with probability > 93 %, at about 2.8 s; go there",
    ]
    opened.run("document.querySelector('.pairs button').click()")
    assert opened.run(f"{part('label')}.textContent").startswith("2.4")


def test_collisions_stand_over_a_time_axis(opened):
    listed = "[...document.querySelectorAll('.pairs .mark')]"
    marks = opened.run(f"{listed}.map((mark) => [mark.textContent, mark.style.left])")
    assert [text for text, _ in marks] == ["0 s", "1 s", "2 s", "3 s", "4 s", "5 s"]
    assert marks[0][1] == "0%"


def test_the_removed_object_has_no_measured_positions(opened):
    set_value(opened, "world", "removed:1", "change")
    opened.wait(f"{part('canvas')}.ariaLabel.startsWith('Without')")
    set_value(opened, "time", 0, "input")
    count = opened.run(
        "(() => {"
        "  const drawn = CanvasRenderingContext2D.prototype.stroke; let strokes = 0;"
        "  CanvasRenderingContext2D.prototype.stroke = function () { strokes += 1; return drawn.call(this); };"
        "  const box = document.querySelector('[data-part=measured]'); const counts = [];"
        "  for (let i = 0; i < 2; i++) { strokes = 0; box.click(); counts.push(strokes); }"
        "  CanvasRenderingContext2D.prototype.stroke = drawn;"
        "  return Math.abs(counts[0] - counts[1]);"
        "})()"
    )
    assert count == 2  # of the two objects that are there at the start, one is removed: one cross of two strokes


def test_question_bars_are_there_and_ordered(opened):
    entropies = opened.run("[...document.querySelectorAll('.question')].map((item) => +item.dataset.entropy)")
    assert entropies == sorted(entropies, reverse=True)
    shares = opened.run(
        "[...document.querySelectorAll('.question .bar')].map((bar) => [+bar.dataset.probability,"
        " bar.querySelector('.fill').getBoundingClientRect().width / bar.getBoundingClientRect().width])"
    )
    assert len(shares) > 20
    assert all(abs(probability - width) < 0.01 for probability, width in shares)


@pytest.mark.parametrize("dark", [False, True])
def test_nothing_overflows_a_phone(opened, page, dark):
    opened.size(390, 844, dark=dark, mobile=True)
    opened.open(page)
    assert opened.run("document.documentElement.scrollWidth") <= 390


def test_dark_pages_are_dark(opened, page):
    opened.size(1280, 900, dark=True)
    opened.open(page)
    assert opened.run("getComputedStyle(document.body).backgroundColor") == "rgb(21, 24, 28)"


def test_tracks_without_a_camera_are_seen_from_above(browser, plain_content, tmp_path):
    browser.problems.clear()
    browser.size(1280, 900)
    browser.open(write_report(plain_content, tmp_path).page)
    assert browser.run("document.querySelector('#player [value=plane]').checked")
    assert browser.run(PIXELS)[1] > 20
    assert browser.problems == []
