"""report.json follows its schema and is strict JSON."""

import json
from dataclasses import replace

import jsonschema
import pytest
from example_content import with_unsure_material

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.draws.summaries import PairSummary, Summary
from vrdp_prob.report import schema, to_document, write_report


def test_follows_the_schema(content, plain_content):
    for case in (content, plain_content, replace(content, answers=(), worlds=(), warnings=())):
        document = json.loads(json.dumps(to_document(case), allow_nan=False))
        jsonschema.validate(document, schema("report"))


def test_answers_stay_in_the_order_asked(content):
    ids = [answer["question_id"] for answer in to_document(content)["answers"]]
    assert ids == [item.answer.question_id for item in content.answers]


def test_an_uncertain_attribute_is_stated_with_its_probabilities(content):
    document = to_document(with_unsure_material(content))
    jsonschema.validate(document, schema("report"))
    assert document["objects"][1]["material"] == "rubber"
    assert document["objects"][1]["attribute_probabilities"] == {"material": {"rubber": 0.55, "metal": 0.45}}
    assert document["objects"][0]["attribute_probabilities"] == {}


def test_undefined_diagnostics_become_null(content):
    convergence = Convergence("laplace", False, float("nan"), float("inf"), None, 0.8)
    document = to_document(replace(content, convergence=convergence))["convergence"]
    assert document == {
        "sampler": "laplace",
        "converged": False,
        "r_hat": None,
        "ess_bulk": None,
        "divergences": None,
        "pareto_k": 0.8,
        "ess_tail": None,
        "worst": None,
    }


def test_number_that_is_not_finite_is_refused(content, tmp_path):
    broken = PairSummary(("1", "2"), Summary(1.0, float("nan"), 0.5, 1.5))
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_report(replace(content, mass_ratios=(broken,)), tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["report", "finding", "evaluation"])
def test_shipped_schemas_are_schemas_and_equal_the_contracts(name, shared_data):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    contract = shared_data.parent / "contracts" / f"{name}.schema.json"
    assert schema(name) == json.loads(contract.read_text(encoding="utf-8"))
