"""report.json follows its schema and is strict JSON."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from vrdp_prob.report import schema, to_document
from vrdp_prob.report.content import ConvergenceContent, Interval


def test_follows_the_schema(content, plain_content):
    for case in (content, plain_content, replace(content, answers=(), worlds=(), warnings=())):
        document = json.loads(json.dumps(to_document(case), allow_nan=False))
        jsonschema.validate(document, schema("report"))


def test_answers_stay_in_the_order_asked(content):
    ids = [answer["question_id"] for answer in to_document(content)["answers"]]
    assert ids == [answer.question_id for answer in content.answers]


def test_undefined_diagnostics_become_null(content):
    convergence = ConvergenceContent("laplace", False, float("nan"), float("inf"), None, 0.8)
    document = to_document(replace(content, convergence=convergence))["convergence"]
    assert document == {
        "sampler": "laplace",
        "converged": False,
        "r_hat": None,
        "ess_bulk": None,
        "divergences": None,
        "pareto_k": 0.8,
    }


def test_summary_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="not finite"):
        Interval(1.0, float("nan"), 0.5, 1.5)


def test_interval_of_draws():
    interval = Interval.from_draws(np.arange(101.0))
    assert (interval.mean, interval.q05, interval.q95) == (50.0, 5.0, 95.0)


@pytest.mark.parametrize("name", ["report", "finding", "evaluation"])
def test_shipped_schemas_are_schemas_and_equal_the_contracts(name, shared_data):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    contract = shared_data.parent / "contracts" / f"{name}.schema.json"
    assert schema(name) == json.loads(contract.read_text(encoding="utf-8"))
