"""The report in one paragraph: what is there, what happened, whether to trust it, how much is in doubt."""

from vrdp_prob.plain_words import counted, listed, number_word, percent, sentence
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.report.content import FACTUAL, AnswerContent, ReportContent
from vrdp_prob.report.wording import seconds
from vrdp_prob.scene import QuestionType
from vrdp_prob.scene.naming import names

CERTAIN_SHARE = 0.95
"""Share of the draws from which on a collision is told as a fact."""

RARE_SHARE = 0.05
"""Share of the draws up to which a collision is not worth telling."""

DOUBTFUL_ENTROPY = 0.5
"""Entropy in nats from which on an answer is called doubtful: that of a yes or no at 80 to 20."""


SMALL_VALID_SHARE = 0.9
"""Share of the draws below which an answer is called doubtful: in the others its question makes no sense."""


def is_doubtful(answer: Answer) -> bool:
    """Whether an answer is open, or comes from too few of the draws to stand for all of them."""
    return answer.entropy >= DOUBTFUL_ENTROPY or answer.valid_share < SMALL_VALID_SHARE


def by_doubt(answers: tuple[AnswerContent, ...]) -> list[AnswerContent]:
    """Doubtful answers first, among them the most ambiguous (largest entropy); equal ones stay in the order asked."""
    return sorted(answers, key=lambda item: (not is_doubtful(item.answer), -item.answer.entropy))


def summary(content: ReportContent) -> list[str]:
    """Sentences of the opening paragraph."""
    parts = [_misfit(content), _objects(content), *_collisions(content), _trust(content), _answers(content)]
    return [part for part in parts if part]


def _misfit(content: ReportContent) -> str:
    if content.misfit is None or content.misfit.fits:
        return ""
    if content.misfit.large:
        return (
            "The model does not explain this motion, as is told below: take every number here as that of a wrong model."
        )
    return "The model may not quite explain this motion, as is told below."


def _objects(content: ReportContent) -> str:
    name = names(content.tracks.bodies)
    listing = listed(f"the {name[body.id]}" for body in content.tracks.bodies)
    count = len(content.objects)
    length = seconds(float(content.tracks.times[-1] - content.tracks.times[0]))
    if count > 6:
        return sentence(f"{counted(count, 'object')} move through {length} of video.")
    return sentence(
        f"{counted(count, 'object')} {'appears' if count == 1 else 'appear'} in {length} of video: {listing}."
    )


def _collisions(content: ReportContent) -> list[str]:
    world = content.world(FACTUAL)
    if world is None:
        return []
    ids = [body.id for body in content.tracks.bodies]
    name = names(content.tracks.bodies)
    sure, unsure = [], []
    for met in world.pairs:
        first, second = (name[ids[body]] for body in met.bodies)
        if met.share >= CERTAIN_SHARE:
            sure.append(f"the {first} with the {second} at {seconds(met.time)}")
        elif met.share > RARE_SHARE:
            unsure.append(f"the {first} with the {second} ({percent(met.share, met.error)})")
    told = sentence(f"{counted(len(sure), 'collision')} happened{': ' + listed(sure) if sure else ''}.")
    return [told, f"Whether others happened is not certain: {listed(unsure)}."] if unsure else [told]


def _trust(content: ReportContent) -> str:
    if not content.convergence.converged:
        return "The fit has not converged: take every number on this page as provisional."
    if not content.warnings:
        return "The fit has converged and nothing speaks against trusting it."
    limits = counted(len(content.warnings), "thing")
    verb = "limits" if len(content.warnings) == 1 else "limit"
    return sentence(f"the fit has converged; {limits} {verb} what it can say, listed below.")


def _answers(content: ReportContent) -> str:
    answers = content.answers
    if not answers:
        return ""
    doubtful = sum(is_doubtful(item.answer) for item in answers)
    if not doubtful:
        return sentence(f"{'the question has' if len(answers) == 1 else 'all questions have'} a clear answer.")
    verb = "is" if doubtful == 1 else "are"
    return f"Of {counted(len(answers), 'question')}, {number_word(doubtful)} {verb} doubtful."


def answer_words(answer: Answer) -> str:
    """The most probable answer in words."""
    if not isinstance(answer.answer, tuple):
        return str(answer.answer)
    count, correct = len(answer.choices), len(answer.answer)
    if count == 1:
        return "correct" if correct else "wrong"
    if correct in (0, count):
        which = ("none", "neither") if correct == 0 else ("all", "both")
        return f"{which[count == 2]} of the choices {'are' if correct else 'is'} correct"
    return f"{counted(correct, 'choice')} of {number_word(count)} {'is' if correct == 1 else 'are'} correct"


TYPE_WORDS = {
    QuestionType.DESCRIPTIVE: "what is there",
    QuestionType.EXPLANATORY: "why it happened",
    QuestionType.PREDICTIVE: "what comes next",
    QuestionType.COUNTERFACTUAL: "what if",
}
"""What each kind of question asks, in words."""
