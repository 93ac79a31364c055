"""The opening paragraph and the order of the questions."""

from dataclasses import replace

import pytest

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.search.misfit import Misfit
from vrdp_prob.report.summary import answer_words, by_doubt, is_doubtful, summary


def test_paragraph_says_what_there_is_and_what_happened(content):
    text = " ".join(summary(content))
    assert text.startswith("Five objects appear in 5.1 s of video: the cyan cube, the purple cube, the gray cylinder,")
    assert "Two collisions happened: the gray cylinder with the cyan sphere at 2.4 s" in text
    assert "The fit has converged; two things limit what it can say" in text
    assert text.endswith("Of 10 questions, four are doubtful.")


@pytest.mark.parametrize(
    ("residual_sd", "acceleration", "start"),
    [
        (0.03, 0.2, "The model does not explain this motion"),
        (0.012, 0.2, "The model may not quite explain this motion"),
        (0.01, None, "Five objects appear"),
    ],
)
def test_a_misfit_is_told_before_any_number(content, residual_sd, acceleration, start):
    misfit = Misfit(residual_sd, 0.01, False, 0.3, "0", 0.02, error_acceleration=acceleration, error_duration=0.2)
    first, *_ = summary(replace(content, misfit=misfit))
    assert first.startswith(start)
    assert (start == "Five objects appear") or not any(letter.isdigit() for letter in first)


def test_paragraph_does_not_trust_a_fit_that_has_not_converged(content):
    failed = replace(content, convergence=Convergence("nuts", False, 1.4, 30.0, 7, None))
    assert "has not converged: take every number on this page as provisional" in " ".join(summary(failed))


def test_paragraph_without_warnings_questions_or_worlds(content):
    text = " ".join(summary(replace(content, warnings=(), answers=(), worlds=())))
    assert text.endswith("nothing speaks against trusting it.")


def test_most_ambiguous_question_comes_first(content):
    entropies = [item.answer.entropy for item in by_doubt(content.answers)]
    assert entropies == sorted(entropies, reverse=True)


def test_an_answer_from_half_of_the_draws_is_doubtful(content):
    sure = content.answers[2]
    assert not is_doubtful(sure.answer)
    half = replace(sure, answer=replace(sure.answer, valid_share=0.53))
    assert is_doubtful(half.answer)
    assert not is_doubtful(replace(sure.answer, valid_share=0.97))
    answers = (*content.answers[:2], half, *content.answers[3:])
    doubtful = [item for item in by_doubt(answers) if is_doubtful(item.answer)]
    assert by_doubt(answers)[: len(doubtful)] == doubtful
    assert doubtful[-1] is half
    assert "five are doubtful" in " ".join(summary(replace(content, answers=answers)))


def test_answers_in_words(content):
    words = {item.answer.question_id: answer_words(item.answer) for item in content.answers}
    assert words[1] == "2"
    assert words[6] == "one choice of four is correct"
    assert words[7] == "two choices of three are correct"
    both = replace(content.answers[3].answer, answer=(0, 1))
    none = replace(content.answers[3].answer, answer=())
    assert (answer_words(both), answer_words(none)) == (
        "both of the choices are correct",
        "neither of the choices is correct",
    )
