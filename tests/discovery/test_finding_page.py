"""finding.html: self-contained, safe, complete, and readable on a small screen."""

import re
from dataclasses import replace

import pytest

from tests.discovery.findings import (
    ANSWERS,
    CHECKS,
    EVERY_KIND,
    TILT,
    WIND,
    named,
    nothing,
    unknown,
    with_a_rest,
    with_answers,
    with_many_videos,
)
from tests.report.browser import Browser, find_chromium
from tests.report.outline import Outline
from vrdp_prob.discovery.finding import Estimate
from vrdp_prob.discovery.page.changed_answers import answers_sentence
from vrdp_prob.discovery.page.finding_page import render
from vrdp_prob.discovery.page.summary import lines, summary, verdict_sentence
from vrdp_prob.discovery.page.wording import TIMES, typeset

ROLLING = Estimate(0.5, 0.1, 0.3, 0.7, "1")
DRAWING = """<?xml version="1.0"?>
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><metadata>http://example.org</metadata>
<clipPath id="a"><rect width="9" height="9"/></clipPath><g id="b" clip-path="url(#a)"/><use href="#b"/></svg>
"""


def text_of(page):
    return Outline(page).text


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_needs_nothing_from_outside_and_nests(kind):
    page = render(EVERY_KIND[kind]())
    assert text_of(page)
    assert all(address.startswith("data:") for address in re.findall(r"(?:src|href)=\"([^\"]*)\"", page))
    assert not re.search(r"@import|https?://|<script", page)
    assert "default-src 'none'" in page
    assert "nan%" not in page
    assert "inf%" not in page
    assert render(EVERY_KIND[kind]()) == page


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_every_word_of_a_finding_is_told(kind):
    finding, page = EVERY_KIND[kind](), render(EVERY_KIND[kind]())
    text = text_of(page)
    assert page.index(typeset(verdict_sentence(finding))[:20]) < page.index("<main>")
    told = (verdict_sentence(finding), *summary(finding), *finding.notes)
    for words in (*told, *(one.sentence for one in (*finding.causes, *finding.checks))):
        assert typeset(words) in text
    for bound in finding.upper_bounds:
        assert bound.parameter in text


def test_the_verdict_is_one_sentence_without_intervals():
    assert verdict_sentence(replace(named(), causes=(TILT,))) == (
        "These 12 videos show that the table slopes by 0.15 degrees, down towards x = 0.83, y = -0.56."
    )
    doubtful = replace(TILT, probability=0.7, sentence="TV pictures shake. They do so often.")
    assert verdict_sentence(replace(named(), causes=(doubtful,), videos=("a", "b", "c"))) == (
        "These three videos suggest that TV pictures shake."
    )
    equal = replace(named(), causes=(replace(TILT, probability=0.3), WIND))
    assert verdict_sentence(equal) == (
        "These 12 videos suggest that the table slopes by 0.15 degrees, down towards x = 0.83, y = -0.56, or, no less "
        "likely, that the air moves at 0.42 m/s towards x = 0.8, y = -0.6."
    )
    assert verdict_sentence(with_a_rest()).startswith(
        "These 12 videos show something that no cause of the catalogue explains, and suggest beside it that"
    )


def test_what_all_causes_bring_together_is_told_before_what_each_brings():
    assert summary(named())[0].startswith(
        "In videos that were left out, all named causes take the error of predicted positions from 12 to 3.4 mm, "
        "surface tilt takes it from 12 to 5.9 mm and contact friction takes it from 5.9 to 3.4 mm"
    )
    together = next(line for line in lines(named()) if line.startswith("  all named causes: left-out videos: +319"))
    assert "error 12 to 3.4 mm (noise 3.0 mm), a factor of 0.27 (0.21 to 0.35)" in together
    alone = replace(named(), causes=(TILT,), gain=TILT.gain)
    assert "all named causes" not in "".join([*lines(alone), render(alone)])


def test_an_error_that_rises_is_told_as_it_is():
    worse = replace(TILT, gain=replace(TILT.gain, before=TILT.gain.after, after=TILT.gain.before))
    assert "from 5.9 to 12 mm" in summary(replace(named(), causes=(worse,)))[0]


def test_named_causes_with_parameters_probability_and_gain():
    text = text_of(render(named()))
    assert "surface tilt probability > 99 %" in text
    assert "Sine of the table's slope, component in which x falls tilt_x 0.00217 0.00188 to 0.00246" in text
    assert "Law: a = g (tilt_x, tilt_y)" in text
    assert "without surface tilt 21 % 48 %" in text
    assert "with surface tilt 38 % 77 %" in text
    assert "10 % each" in render(named())
    assert "measurement noise, 3.0 mm" in text
    assert "12 of 12 videos are predicted better." in text
    assert "without and with all named causes" in text
    assert "with all named causes 49 % 90 %" in text
    assert "with surface tilt 0.48 (0.40 to 0.57) 0.62 (0.53 to 0.72) 0.44 (0.37 to 0.53)" in text
    assert "Also possible" in text
    assert "Looked at closely and not needed" in text


def test_checks_that_fail_come_first():
    text = text_of(render(named()))
    table, _, fold = text.partition("Four checks that show nothing")
    failing = [check.name for check in CHECKS if check.significant]
    assert all(name in table and name not in fold for name in failing)
    assert f"3{TIMES}10⁻³⁸ ✗ 0.62" in table
    assert f"2{TIMES}10⁻⁴ ✗ 0.0043 ✗" in table
    assert "With the extended model: Slow contacts still change the spin too much." in table
    order = [fold.index(check.name) for check in sorted(CHECKS, key=lambda check: check.p_value) if check.name in fold]
    assert len(order) == 4
    assert order == sorted(order)


def test_a_check_that_fails_only_under_the_extended_model_is_not_folded_away():
    finding = named()
    after = tuple(replace(check, significant=check.name == CHECKS[0].name) for check in finding.checks_after)
    table, _, fold = text_of(render(replace(finding, checks_after=after))).partition("Three checks that show nothing")
    assert CHECKS[0].name in table
    assert CHECKS[0].name not in fold


def test_bounds_lead_where_nothing_was_found():
    text = text_of(render(nothing()))
    assert text.index("What could have hidden") < text.index("Where the model fails")
    assert "≤ 0.00031" in text
    assert "no bound" in text
    assert "<details open>" in render(nothing())
    assert "The cause" not in text.replace("The causes", "")


def test_the_unknown_is_marked_as_a_description():
    text = text_of(render(unknown()))
    assert "A description, not a cause" in text
    assert "a_x = 0.041 sin(6.2 t) - 0.11 v_y" in text
    assert "follows 61 % of its variance in videos that were left out" in text
    assert "J = 0.12 J_n s" in text
    assert "missing at contacts explains 34 % of what is left beside it" in text
    assert "A description, not a cause" in text_of(render(with_a_rest()))


def test_what_was_tried_and_not_established_is_told_with_what_it_would_need():
    text = text_of(render(unknown()))
    assert "Tried and not established" in text
    assert "by 6.0 nats, and to have a probability of 80 % against" in text
    assert "pair force +4.2 ± 3.1 21 % it gains too little" in text
    told = "Tried and not established: pair force (+4.2 ± 3.1) and friction patch"
    assert any(line.startswith(told) and line.endswith("6.0 are needed.") for line in lines(unknown()))
    assert "Tried and not established" not in text_of(render(named()))


def test_answers_that_change_lead_and_those_that_do_not_are_left_out():
    page = render(with_answers())
    stops, happens = (page.index(answer.question) for answer in ANSWERS[:2])
    assert stops < happens
    assert ANSWERS[2].question not in page
    told = text_of(page)
    assert "Of three questions about these videos, one is answered otherwise with the extended model; 2 of 3 " in told
    assert "answers are right with it, 1 without." in told
    rows = re.sub(r"\s+", " ", page[stops:happens])
    assert "<td>cube</td><td><b>64 %</b></td><td>21 %</td>" in rows
    assert '<td>sphere <span class="right">right</span></td><td>36 %</td><td><b>79 %</b></td>' in rows


def test_of_many_changed_answers_most_are_folded_away():
    page = render(replace(named(), answers=(ANSWERS[0],) * 12))
    assert page.count(ANSWERS[0].question) == 12
    assert "Four more questions" in text_of(page)
    assert "What it changes in the answers" not in text_of(render(named()))


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        ((), "no question about these videos could be answered with both models"),
        (ANSWERS[2:], "of one question about these videos, none is answered otherwise with the extended model; 0 of 1"),
    ],
)
def test_how_many_answers_change_in_a_sentence(answers, said):
    assert answers_sentence(answers).startswith(said)


def test_nothing_is_said_of_right_answers_that_nobody_knows():
    unjudged = replace(ANSWERS[0], options=tuple(replace(option, right=None) for option in ANSWERS[0].options))
    assert answers_sentence((unjudged,)) == (
        "of one question about these videos, one is answered otherwise with the extended model"
    )


def test_many_videos_are_stacked_dots():
    page = render(with_many_videos())
    assert page.count("<title>shot_") == 62
    assert "61 of 62 videos are predicted better." in text_of(page)


def test_the_model_file_is_there_to_copy():
    text = text_of(render(named()))
    assert 'name = "base+surface_tilt+contact_friction"' in text
    assert "vrdp-prob report INPUT --model model.toml" in text


def test_text_of_a_finding_is_no_html():
    page = render(EVERY_KIND["at_its_limits"]())
    assert "<b>&</b>" not in page
    assert "&lt;b&gt;&amp;&lt;/b&gt;" in page


def test_figures_stand_in_the_page_with_names_of_their_own():
    page = render(replace(named(), figures={"Along the path": DRAWING, "Across <it>": DRAWING}))
    assert "<?xml" not in page
    assert "http://" not in page.replace('xmlns="http://www.w3.org/2000/svg"', "")
    assert page.index("Along the path") < page.index("Across &lt;it&gt;")
    for index in range(2):
        assert f'clip-path="url(#figure{index}-a)"' in page
        assert f'href="#figure{index}-b"' in page
    identities = re.findall(r' id="([^"]*)"', page)
    assert len(identities) == len(set(identities))
    Outline(page)


def test_a_figure_that_is_no_svg_is_a_mistake():
    with pytest.raises(ValueError, match="must be an SVG element"):
        render(replace(named(), figures={"Nothing": "<p>a picture</p>"}))


def test_lines_for_a_terminal_are_lines():
    for make in EVERY_KIND.values():
        assert all("\n" not in line and line.strip() for line in lines(make()))


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    executable = find_chromium()
    if executable is None:
        pytest.skip("no Chromium is installed (chromium, chromium-browser, google-chrome or chrome)")
    with Browser(executable, tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.browser
@pytest.mark.parametrize("width", [360, 500, 1200])
@pytest.mark.parametrize("kind", EVERY_KIND)
def test_a_browser_shows_it_without_scrolling_sideways(browser, tmp_path, kind, width):
    file = tmp_path / "finding.html"
    file.write_text(render(replace(EVERY_KIND[kind](), figures={"Along the path": DRAWING})), encoding="utf-8")
    browser.problems.clear()
    browser.requests.clear()
    browser.size(width, 900)
    browser.open(file)
    browser.run("document.querySelectorAll('details').forEach((fold) => { fold.open = true; })")
    assert browser.run("document.documentElement.scrollWidth <= window.innerWidth")
    assert browser.problems == []
    assert all(request.startswith(("data:", file.as_uri())) for request in browser.requests)


def test_values_of_single_bodies_are_folded_where_they_are_many():
    many = {f"release_rolling[{body} in v{number}]": ROLLING for body in ("white", "red") for number in range(4)}
    slip = replace(TILT, name="slip_to_roll", parameters={"slip_friction": ROLLING, **many}, way=None)
    finding = replace(named(), causes=(slip,))
    page = render(finding)
    folded = re.search(r"<details>\s*<summary>Eight values of single bodies</summary>.*?</details>", page, re.DOTALL)
    assert folded is not None
    assert all(f"<code>{name}</code>" in folded[0] for name in many)
    assert "<code>slip_friction</code>" not in folded[0]
    told = "\n".join(lines(finding))
    assert "slip friction 0.50" in told
    assert "and eight values of single bodies" in told
    assert "release rolling" not in told
    times = {f"impulse_time[v{number}]": ROLLING for number in range(4)}
    sizes = {f"impulse_x[white in v{number}]": ROLLING for number in range(8)}
    kicks = replace(slip, name="external_impulse", parameters={**times, **sizes})
    assert "values of single bodies" not in render(replace(finding, causes=(kicks,)))
    few = replace(slip, parameters=dict(list(slip.parameters.items())[:4]))
    assert "values of single bodies" not in render(replace(finding, causes=(few,)))


def test_values_of_single_videos_are_folded_where_they_are_many():
    places = {f"dropped_after_{place}[v{number}]": ROLLING for place in (1, 2, 3) for number in (1, 2)}
    parameters = {"dropped_frame_time": ROLLING, **places}
    dropped = replace(TILT, name="clock_error", parameters=parameters, way="dropped_frames")
    finding = replace(named(), causes=(dropped,))
    assert "<summary>Six values of single videos</summary>" in render(finding)
    assert "and six values of single videos" in "\n".join(lines(finding))


def test_it_says_why_strengths_have_no_bound():
    finding = unknown()
    strengths = tuple(replace(one, bound=None) for one in finding.upper_bounds)
    size = replace(finding.upper_bounds[0], name="hidden_obstacle", parameter="obstacle_radius", measure="its radius")
    why = "what no cause explains may be hiding any of them"
    assert why in text_of(render(replace(finding, upper_bounds=(*strengths, size))))
    assert why not in text_of(render(replace(finding, upper_bounds=(size,))))
    assert why not in text_of(render(finding))


def test_a_description_without_accelerations_tells_of_none():
    finding = unknown()
    without = replace(finding, description=replace(finding.description, size=None))
    assert "The missing acceleration is" in text_of(render(finding))
    assert "The missing acceleration is" not in text_of(render(without))


def test_where_nothing_is_named_the_page_says_how_well_the_model_predicts() -> None:
    held = unknown().predicted
    assert held is not None
    page = text_of(render(unknown()))
    for words in ("How well left-out videos are predicted", "Error of predicted positions, mm", "measurement noise"):
        assert words in page
    assert f"{100 * held.coverage_90:.0f} %" in page
    assert "How well left-out videos are predicted" not in text_of(render(named()))
