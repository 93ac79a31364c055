"""report.html: one page that opens from disk, with all it needs inside it."""

import json
import math
from typing import Any

from markupsafe import Markup

from vrdp_prob.inference.draws.summaries import PairSummary, ParameterSummary, Summary
from vrdp_prob.plain_words import counted, listed, percent, percent_error, sentence
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.report.axes import log_axis, unit_axis
from vrdp_prob.report.content import FACTUAL, FUTURE, AnswerContent, Footage, ReportContent
from vrdp_prob.report.figures import FIGURE_DRAWS, still_figure
from vrdp_prob.report.footage import still_uri
from vrdp_prob.report.payload import player_data
from vrdp_prob.report.summary import (
    SMALL_VALID_SHARE,
    TYPE_WORDS,
    answer_words,
    by_doubt,
    is_doubtful,
    summary,
)
from vrdp_prob.report.templating import asset, environment
from vrdp_prob.report.wording import (
    color_of,
    interval_words,
    mass_status,
    restitution_status,
    rests_on,
    seconds,
    tags,
    uncertain_attributes,
    with_names,
    world_label,
)
from vrdp_prob.scene.naming import names

SCRIPTS = ("worlds.js", "views.js", "scene.js", "player.js")
"""The player's sources, in the order they go into the page."""


def render(content: ReportContent) -> str:
    """The page as HTML text; the same content gives the same text."""
    values = {
        **_opening(content),
        **_player(content),
        **_questions(content),
        **_estimates(content),
        **_closing(content),
    }
    return environment().get_template("page.html.j2").render(values)


def _objects(content: ReportContent) -> list[dict[str, Any]]:
    name, tag = names(content.tracks.bodies), tags(content.tracks.bodies)
    return [
        {
            "id": body.id,
            "name": name[body.id],
            "tag": tag[body.id],
            "color": color_of(body, index),
            "shape": str(body.shape),
            "doubts": uncertain_attributes(body),
        }
        for index, body in enumerate(content.tracks.bodies)
    ]


def _opening(content: ReportContent) -> dict[str, Any]:
    footage = _seen_by_camera(content)
    draws = max((min(world.draws, FIGURE_DRAWS) for world in content.worlds[:2]), default=0)
    future = content.world(FUTURE)
    if footage is not None:
        caption = f"The frame at {seconds(footage.time)}. "
    else:
        caption = "The plane from above. " if content.tracks.camera is None else "The plane as the camera sees it. "
    caption += "Dots: measured positions."
    if draws:
        caption += f" Lines: {draws} posterior draws"
        caption += f", carried on to {seconds(float(future.times[-1]))}, where the rings stand." if future else "."
    return {
        "css": asset("page.css"),
        "video": content.tracks.video,
        "summary": " ".join(summary(content)),
        "limits": [with_names(warning, content.tracks.bodies) for warning in content.warnings],
        "converged": content.convergence.converged,
        "objects": _objects(content),
        "still": still_figure(content),
        "still_image": still_uri(footage.still) if footage is not None else None,
        "still_caption": caption,
        "still_label": "Measured tracks and posterior rollouts of "
        + listed(f"the {name}" for name in names(content.tracks.bodies).values()),
    }


def _seen_by_camera(content: ReportContent) -> Footage | None:
    """The footage where the camera says what is where in it."""
    return content.footage if content.tracks.camera is not None else None


def _player(content: ReportContent) -> dict[str, Any]:
    shown = _seen_by_camera(content)
    return {
        "has_worlds": bool(content.worlds),
        "has_film": shown is not None,
        "has_camera": content.tracks.camera is not None,
        "floor_image": None if shown is None else still_uri(shown.floor),
        "player_data": _script_json(player_data(content)) if content.worlds else None,
        "javascript": Markup("\n").join(asset(name) for name in SCRIPTS),
    }


def _script_json(value: Any) -> Markup:
    """Strict JSON that cannot end the script element it stands in."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def _questions(content: ReportContent) -> dict[str, Any]:
    ordered = by_doubt(content.answers)
    parts = (
        ("Doubtful", _doubt_words(content), [item for item in ordered if is_doubtful(item.answer)]),
        ("Clear", "", [item for item in ordered if not is_doubtful(item.answer)]),
    )
    return {
        "groups": [
            {"title": title, "meaning": meaning, "questions": [_question(item, content) for item in items]}
            for title, meaning, items in parts
            if items
        ]
    }


def _doubt_words(content: ReportContent) -> str:
    words = "at least as open as 80 to 20"
    if any(item.answer.valid_share < SMALL_VALID_SHARE for item in content.answers):
        words += f", or answered from less than {percent(SMALL_VALID_SHARE)} of the draws"
    return words


def _question(item: AnswerContent, content: ReportContent) -> dict[str, Any]:
    answer = item.answer
    name = names(content.tracks.bodies)
    notes = list(answer.notes)
    if answer.relies_on_default:
        who = listed(f"the {name.get(body, body)}" for body in answer.relies_on_default)
        notes.insert(0, rests_on(who))
    world = next((world for world in content.worlds if world.key == item.world), None)
    if world is not None and world.kind == FACTUAL:
        world = None  # the page opens with it
    label = "" if world is None else world_label(world, content.tracks)
    return {
        "kind": sentence(TYPE_WORDS[answer.question_type]),
        "text": answer.question,
        "entropy": round(answer.entropy, 6),
        "answer": answer_words(answer),
        "multiple": bool(answer.choices),
        "probability": percent(answer.probability, answer.mc_error),
        "error": percent_error(answer.probability, answer.mc_error),
        "base": f"from {percent(answer.valid_share)} of the draws" if answer.valid_share < 1 else "",
        "bars": _bars(answer),
        "notes": notes,
        "reasons": _reasons(item, content),
        "world": None if world is None else world.key,
        "world_label": f"Show {label[:1].lower()}{label[1:]}",
    }


def _reasons(item: AnswerContent, content: ReportContent) -> list[str]:
    """Why the answer is uncertain, in sentences."""
    if item.explanation is None:
        return []
    return [with_names(reason, content.tracks.bodies) for reason in item.explanation.sentences]


def _bars(answer: Answer) -> list[dict[str, Any]]:
    if answer.choices:
        chosen = answer.answer if isinstance(answer.answer, tuple) else ()
        return [
            _bar(choice.choice, choice.probability, choice.mc_error, choice.choice_id in chosen)
            for choice in answer.choices
        ]
    shown = sorted(answer.distribution.items(), key=lambda item: -item[1])
    bars = []
    for value, probability in shown:
        if probability >= 0.005 or value == str(answer.answer):
            chosen_one = value == str(answer.answer)
            bars.append(_bar(value, probability, answer.mc_error if chosen_one else 0.0, chosen_one))
    rest = 1 - sum(bar["probability"] for bar in bars)
    return [*bars, _bar("something else", rest, 0.0, False)] if bars and rest >= 0.005 else bars


def _bar(text: str, probability: float, error: float, chosen: bool) -> dict[str, Any]:
    share, plus_minus = percent(probability, error), percent_error(probability, error)
    return {
        "text": text,
        "probability": round(probability, 6),
        "place": round(100 * min(max(probability, 0), 1), 2),
        "error_low": round(100 * max(probability - error, 0), 2),
        "error_high": round(100 * min(probability + error, 1), 2),
        "chosen": chosen,
        "percent": share,
        "error": plus_minus,
        "label": f"{text}: {share} {plus_minus}".strip(),
    }


def _estimates(content: ReportContent) -> dict[str, Any]:
    objects = {item["id"]: item for item in _objects(content)}
    name = names(content.tracks.bodies)
    known = list(zip(content.tracks.bodies, content.objects, strict=True))
    pairs = content.restitution_pairs
    parameters = [parameter for _, learned in known for parameter in (learned.mass, learned.restitution)]
    return {
        "has_defaults": any(parameter.status == "default" for parameter in parameters)
        or not all(pair.determined for pair in (*pairs, *content.mass_ratios)),
        "mass_unit": "kg" if any(body.mass is not None for body, _ in known) else "relative to 1",
        "mass_axis": log_axis([learned.mass.summary for _, learned in known]),
        "masses": [
            _body_row(objects[body.id], learned.mass, mass_status(learned.mass, body, name)) for body, learned in known
        ],
        "restitution_axis": unit_axis(
            [learned.restitution.summary for _, learned in known] + [pair.summary for pair in pairs]
        ),
        "restitutions": [
            _body_row(objects[body.id], learned.restitution, restitution_status(learned.restitution, name))
            for body, learned in known
        ],
        "ratio_axis": log_axis([pair.summary for pair in content.mass_ratios]),
        "ratios": [_pair_row(pair, objects, "over") for pair in content.mass_ratios],
        "pairs": [_pair_row(pair, objects, "and") for pair in pairs],
    }


def _body_row(shown: dict[str, Any], parameter: ParameterSummary, words: str) -> dict[str, Any]:
    known = parameter.status != "default"
    return {**_row([shown], parameter.summary), "words": words, "known": known, "between": ""}


def _pair_row(pair: PairSummary, objects: dict[str, dict[str, Any]], between: str) -> dict[str, Any]:
    row = _row([objects[body] for body in pair.objects], pair.summary)
    words = "" if pair.determined else "The data say nothing of these two together."
    return {**row, "words": words, "known": pair.determined, "between": between}


def _row(objects: list[dict[str, Any]], interval: Summary) -> dict[str, Any]:
    mean, span = interval_words(interval)
    label = f"{listed(item['name'] for item in objects)}: {mean}, 90 % interval: {span}"
    return {"objects": objects, "interval": interval, "mean": mean, "range": span, "label": label}


def _combinations(content: ReportContent) -> list[tuple[str, str, str]]:
    """Term, value and meaning of what the collisions of each group determine."""
    rows = []
    for combination in (one for group in content.groups for one in group.combinations):
        name = sentence(with_names(combination.name, content.tracks.bodies))
        if combination.determined:
            told = f"the data took away {percent(combination.contraction)} of the prior variance (of the logarithm)"
            rows.append((name, f"known to {100 * combination.relative_sd:.2g} %", told))
        else:
            rows.append((name, "not determined", "as believed beforehand"))
    return rows


def _closing(content: ReportContent) -> dict[str, Any]:
    return {
        "combinations": _combinations(content),
        "prior_words": [
            with_names(one.sentence, content.tracks.bodies) for one in content.sensitivities if one.sentence
        ],
        "convergence_words": content.convergence.sentence,
        "diagnostics": _diagnostics(content),
        "model": content.model,
        "effects": listed(effect.replace("_", " ") for effect in content.effects) if content.effects else "",
        "sampler": content.convergence.sampler,
        "seed": content.seed,
        "version": content.version,
    }


def _diagnostics(content: ReportContent) -> list[tuple[str, str, str]]:
    """Term, value and meaning of each diagnostic that applies."""
    convergence = content.convergence
    rows: list[tuple[str, str, str]] = [*_misfit_rows(content), ("Sampler", convergence.sampler, "")]
    if convergence.r_hat is not None and math.isfinite(convergence.r_hat):
        rows.append(
            ("R-hat, largest", f"{convergence.r_hat:.3f}", "1 where independent runs agree; below 1.01 is good")
        )
    if convergence.ess_bulk is not None and math.isfinite(convergence.ess_bulk):
        meaning = f"independent draws that the dependent ones are worth; {convergence.ess_goal:g} or more are good"
        rows.append(("Effective sample size, smallest", f"{convergence.ess_bulk:.0f}", meaning))
    if convergence.ess_tail is not None and math.isfinite(convergence.ess_tail):
        meaning = f"the same for the ends of 90 % intervals; {convergence.ess_goal:g} or more are good"
        rows.append(("... in the tails", f"{convergence.ess_tail:.0f}", meaning))
    if convergence.divergences is not None:
        rows.append(
            (
                "Divergences",
                str(convergence.divergences),
                "steps at which the sampler lost its way; below 1 % of all is good",
            )
        )
    if convergence.cliffs:
        meaning = "steps that ended where a contact comes or goes, behind which nothing is probable; no fault"
        rows.append(("Ended at a contact", str(convergence.cliffs), meaning))
    if convergence.pareto_k is not None and math.isfinite(convergence.pareto_k):
        meaning = "tail of the importance weights; below 0.7 is good"
        rows.append(("Pareto k", f"{convergence.pareto_k:.2f}", meaning))
    changes = convergence.collision_order_changes
    if changes is not None:
        rows.append(("Other order of collisions", percent(changes), "of the draws, against the most probable world"))
    if content.worlds:
        meaning = "a sample of the posterior; worlds that no question asks about were simulated in these alone"
        rows.append(("Draws in the player", counted(content.worlds[0].draws, "draw"), meaning))
    return rows


def _misfit_rows(content: ReportContent) -> list[tuple[str, str, str]]:
    """Term, value and meaning of how the model explains the tracks."""
    misfit = content.misfit
    if misfit is None:
        return []
    noise = f"of the best fit; the noise of the tracks is {1000 * misfit.noise_sd:.2g} mm"
    alike = f"mean squared residual in units of the noise; neighbouring ones have correlation {misfit.correlation:.2f}"
    rows = [
        ("Residuals", f"{1000 * misfit.residual_sd:.2g} mm", noise),
        ("Chi-square", f"{misfit.chi_square:.2f} per position and axis", alike),
    ]
    if misfit.error_acceleration is not None:
        meaning = f"that the intervals allow for; it lasts about {misfit.error_duration:.2g} s"
        rows.append(("Unknown acceleration", f"{misfit.error_acceleration:.2g} m/s²", meaning))
    return rows
