"""report.html: self-contained, safe, complete."""

import json
import re
from dataclasses import replace

import pytest
from example_content import with_question, with_unsure_material
from outline import Outline

from vrdp_prob.report import render
from vrdp_prob.report.payload import player_data


@pytest.fixture(scope="module")
def page(content):
    return render(content)


def test_page_needs_nothing_from_outside(page):
    addresses = re.findall(r"(?:src|href|action|data)=\"([^\"]*)\"", page)
    assert addresses
    assert all(address.startswith("data:") for address in addresses)
    assert not re.search(r"@import|url\(|https?://", page)
    assert "default-src 'none'" in page


def test_page_is_of_modest_size(page):
    assert len(page) < 3e6


def test_same_content_gives_the_same_page(content, page):
    assert render(content) == page


def test_page_says_everything(content, page):
    text = Outline(page).text
    for answer in (item.answer for item in content.answers):
        assert answer.question in text
        assert all(choice.choice in text for choice in answer.choices)
    for warning in content.warnings:
        assert warning in text
    assert "Drawn from the prior: no collision tells it, and the data say nothing." in text
    assert "Only its ratio to the gray cylinder and the cyan sphere is known" in text
    assert "Rests on mass or restitution of the cyan cube and the yellow sphere" in text
    assert "sliding friction, rolling resistance and air drag" in text
    assert "seed 0" in text


def test_questions_stand_in_the_order_of_doubt(page):
    entropies = [
        float(attributes["data-entropy"]) for _, attributes in Outline(page).attributes if "data-entropy" in attributes
    ]
    assert len(entropies) == 10
    assert entropies == sorted(entropies, reverse=True)


def test_a_small_share_of_the_draws_is_shown(content):
    open_answer, choices = content.answers[2], content.answers[3]
    few = [replace(item, answer=replace(item.answer, valid_share=0.53)) for item in (open_answer, choices)]
    text = Outline(render(replace(content, answers=tuple(few)))).text
    assert "at least as open as 80 to 20, or answered from less than 90 % of the draws" in text
    assert "no (from 53 % of the draws)" in text
    assert ", from 53 % of the draws)" in text
    assert "of the draws)" not in Outline(render(content)).text


def test_limits_name_the_objects(content):
    text = Outline(render(replace(content, warnings=("Objects 0, 4 never collide in view.",)))).text
    assert "The cyan cube and the yellow sphere never collide in view." in text


def test_legend_speaks_of_defaults_only_where_there_are_some(content, page):
    assert "hollow dots" in page
    objects = tuple(
        replace(
            learned,
            mass=replace(learned.mass, status="identified"),
            restitution=replace(learned.restitution, status="identified"),
        )
        for learned in content.objects
    )
    assert "hollow dots" not in render(replace(content, objects=objects))


def test_an_uncertain_attribute_is_shown(content, page):
    said = "purple cube (material 55 % rubber, 45 % metal)"
    assert said in Outline(render(with_unsure_material(content))).text
    assert "% rubber" not in Outline(page).text


def test_hypotheses_have_a_way_to_the_player(page):
    worlds = [
        attributes["data-world"]
        for tag, attributes in Outline(page).attributes
        if tag == "button" and "data-world" in attributes
    ]
    assert sorted(worlds) == ["future", "heavier:2", "lighter:3", "removed:1"]


def test_text_of_others_is_escaped(content):
    attack = "What <script>alert('x')</script> & \"why\"?"
    page = render(with_question(content, attack))
    assert "<script>alert" not in page
    assert attack in Outline(page).text


def test_names_cannot_end_the_script_that_holds_them(content):
    evil = replace(content.tracks.bodies[0], id="</script><b>", color=None)
    bodies = (evil, *content.tracks.bodies[1:])
    data = content.tracks.data.assign_coords(body=[body.id for body in bodies])
    hostile = replace(
        content,
        tracks=replace(content.tracks, bodies=bodies, data=data),
        objects=(replace(content.objects[0], body=evil.id), *content.objects[1:]),
        answers=(),
        worlds=content.worlds[:2],
    )
    page = render(hostile)
    assert "</script><b>" not in page
    stored = re.search(r'id="player-data">(.*?)</script>', page, re.DOTALL).group(1)
    assert json.loads(stored) == json.loads(json.dumps(player_data(hostile)))


def test_page_without_camera_worlds_or_questions(plain_content):
    text = Outline(render(plain_content)).text
    assert "The plane from above." in text
    assert "as the camera sees it" not in text
    bare = Outline(
        render(replace(plain_content, worlds=(), answers=(), warnings=(), mass_ratios=(), restitution_pairs=()))
    )
    assert "Watch it" not in bare.text
    assert "Questions" not in bare.text
    assert "No limit was found" in bare.text


def test_the_figure_without_footage_says_from_where_it_is_seen(content):
    text = Outline(render(replace(content, footage=None))).text
    assert "The plane as the camera sees it." in text
    assert "from above" not in text


def test_page_of_a_fit_that_has_not_converged_does_not_claim_otherwise(content):
    failed = replace(content, convergence=replace(content.convergence, converged=False), warnings=())
    text = Outline(render(failed)).text
    assert "No limit was found" not in text
    assert "not converged" in text
