"""finding.json follows its schema, is strict JSON, and holds what the page shows."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest

from tests.discovery.findings import BASE, EVERY_KIND, VIDEOS, at_its_limits, named, nothing, unknown, with_answers
from vrdp_prob.discovery.page.document import to_document, write_finding
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.report import schema


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_follows_the_schema(kind):
    written = json.dumps(to_document(EVERY_KIND[kind]()), allow_nan=False)
    jsonschema.validate(json.loads(written), schema("finding"))


def test_a_cause_with_its_gain():
    causes = to_document(named())["causes"]
    assert [(cause["name"], cause["named"]) for cause in causes] == [
        ("surface_tilt", True),
        ("contact_friction", True),
        ("wind", False),
        ("lens_distortion", False),
    ]
    assert causes[0]["parameters"]["tilt_x"] == {
        "mean": 0.002172,
        "sd": 0.000148,
        "q025": 0.00188,
        "q975": 0.002463,
        "unit": "1",
    }
    gain = causes[0]["held_out_gain"]
    assert (gain["rmse_before"], gain["rmse_after"]) == pytest.approx((0.0123, 0.0059))
    assert gain["unit"] == "m"
    assert gain["elpd_difference"] == 231.4
    assert gain["elpd_se"] > 0
    assert (gain["before"]["coverage_90"], gain["after"]["coverage_90"]) == (0.48, 0.77)
    assert gain["before"]["rmse_end"] > gain["before"]["rmse"] > gain["before"]["rmse_one_second"]
    assert list(gain["elpd_difference_by_video"]) == list(VIDEOS)
    assert sum(gain["elpd_difference_by_video"].values()) == pytest.approx(231.4)


def test_the_gain_of_the_whole_model():
    gain = to_document(named())["gain"]
    assert gain["elpd_difference"] == 318.6
    assert set(gain["error_ratios"]) == {"rmse", "rmse_one_second", "rmse_end"}
    ratio = gain["error_ratios"]["rmse"]
    assert ratio["q025"] < ratio["ratio"] < ratio["q975"] < 0.5
    assert len(gain["after"]["by_video"]) == len(VIDEOS)
    assert to_document(nothing())["gain"] is None


def test_how_well_the_model_given_predicts_is_told_where_nothing_is_named() -> None:
    told = to_document(unknown())["predicted"]
    assert told["noise_sd"] == 0.003
    assert told["rmse"] == pytest.approx(0.0123)
    assert len(told["pit"]) == 10
    assert to_document(nothing())["predicted"] is None


def test_evidence_bounds_and_notes():
    found = to_document(named())
    assert [entry["significant"] for entry in found["evidence"]] == [False, True, True, False, False, False]
    assert [entry["significant"] for entry in found["evidence_after"]] == [False, False, True, False, False, False]
    assert found["evidence"][1]["p_value"] == 3.1e-38
    assert found["upper_bounds"][0] == {
        "name": "linear_drag",
        "effect": "linear_drag",
        "parameter": "linear_drag",
        "bound": 0.0123,
        "unit": "1/s",
        "vanishes_at": 0.0,
        "places": 1,
        "told": 1,
        "remark": None,
        "measure": None,
    }
    assert found["upper_bounds"][-1]["bound"] is None
    assert found["notes"] == ["Two videos end before 1 s; their errors at 1 s are not counted."]
    assert found["videos"] == list(VIDEOS)


def test_answers_of_both_models():
    assert to_document(named())["answers"] is None
    first, second, _ = to_document(with_answers())["answers"]
    assert (first["video"], first["question"]) == ("run_03", "What shape is the object that stops first?")
    assert first["options"][1] == {
        "words": "sphere",
        "before": 0.36,
        "after": 0.79,
        "chosen_before": False,
        "chosen_after": True,
        "right": True,
    }
    assert (first["differs"], second["differs"]) == (True, False)


def test_the_unknown_is_described():
    found = to_document(unknown())
    assert found["verdict"] == "unknown"
    assert found["description"]["explained"] == 0.61
    assert found["tried"][0] == {
        "name": "pair_force",
        "effect": "pair_force",
        "gain": 4.2,
        "gain_se": 3.1,
        "gain_needed": 5.99,
        "probability": 0.21,
        "probability_needed": 0.8,
        "why": "it gains too little",
    }
    assert {one["name"] for one in found["tried"]}.isdisjoint(cause["name"] for cause in found["causes"])
    assert found["description"]["formula"].startswith("a_x = ")
    assert (found["description"]["contact_formula"], found["description"]["contact_explained"]) == (
        "J = 0.12 J_n s",
        0.34,
    )
    assert to_document(nothing())["description"] is None


def test_what_is_not_finite_is_null_or_where_a_number_is_required_the_largest_one():
    found = to_document(at_its_limits())
    jsonschema.validate(json.loads(json.dumps(found, allow_nan=False)), schema("finding"))
    cause = found["causes"][0]
    assert cause["parameters"]["tilt_x"] == {"mean": None, "sd": None, "q025": None, "q975": None, "unit": "1"}
    gain = cause["held_out_gain"]
    assert gain["rmse_before"] == gain["elpd_difference"] == gain["elpd_se"] == sys.float_info.max
    assert gain["before"] == {
        "rmse": None,
        "rmse_one_second": None,
        "rmse_end": None,
        "coverage_50": None,
        "coverage_90": 0.0,
        "pit": [],
        "by_video": [],
    }
    assert set(gain["elpd_difference_by_video"].values()) == {None}
    assert found["evidence"][0]["p_value"] is None
    assert found["upper_bounds"][0]["bound"] is None


def test_an_unknown_difference_is_no_gain():
    tilt = named().causes[0]
    lost = replace(tilt, gain=replace(tilt.gain, elpd_difference=float("nan")))
    assert to_document(replace(named(), causes=(lost,)))["causes"][0]["held_out_gain"]["elpd_difference"] == 0


def test_the_model_is_where_the_document_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = write_finding(named(), Path("deep/out"))
    found = json.loads(files.document.read_text(encoding="utf-8"))
    monkeypatch.chdir("/")
    model = PhysicsModel.read(found["model"])
    assert [effect.name for effect in model.effects] == found["extended_model"]["effects"]
    assert found["base_model"] == {"name": "base", "effects": [effect.name for effect in BASE.effects]}
    assert (tmp_path / "deep" / "out" / "model.toml").read_text(encoding="utf-8") == found["extended_model"]["toml"]


def test_the_same_finding_gives_the_same_files(tmp_path):
    first, second = (write_finding(named(), tmp_path / "out").page.read_bytes() for _ in range(2))
    assert first == second
