"""What the model that a finding extends answers otherwise, in questions about the videos that it is from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from vrdp_prob.discovery.finding import ComparedAnswer, ComparedOption, Finding
from vrdp_prob.errors import InputError, check_whole_number
from vrdp_prob.inference import infer
from vrdp_prob.inference.runs.parallel import in_processes, several_processes
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning import Answer, PosteriorWorlds, ask
from vrdp_prob.reasoning.vocabulary import ChangeWord
from vrdp_prob.scene import Question, Tracks
from vrdp_prob.scene.question import RIGHT
from vrdp_prob.workers import check_processes

DRAWS = 200
NOT_ASKED = "The questions were not asked: no cause is named, so there is no second model whose answers could differ."


def with_answers(
    finding: Finding,
    videos: Sequence[Tracks],
    questions: Mapping[str, Sequence[Question]],
    *,
    words: Sequence[ChangeWord] = (),
    seed: int = 0,
    processes: int | None = None,
    progress: ProgressDisplay | None = None,
) -> Finding:
    """A finding that also tells what both models answer to questions about its videos.

    Each model answers from Laplace draws of each video alone, which are not handed on to emcee where they cannot be
    trusted; what the other videos say is its prior. What happened once in a video, as a kick, is in neither model. A
    question that one of them cannot answer is left out and told of. Where no cause is named there is one model only,
    nothing is asked, and a note says so.

    Parameters
    ----------
    finding
        What was found in the videos.
    videos
        The videos.
    questions
        Questions about each by its name; videos without any are not looked at.
    words
        Learned words that the questions may use.
    seed
        Seed of the draws.
    processes
        Number of processes that work on videos side by side; as many as there are cores where None.
    progress
        Who follows the work.

    Raises
    ------
    InputError
        If seed or processes are no whole number of at least 0 or 1.
    """
    check_whole_number("seed", seed, least=0)
    check_processes(processes)
    if not finding.named:
        return replace(finding, notes=(*finding.notes, NOT_ASKED)) if any(questions.values()) else finding
    asked = [
        (tracks, tuple(questions[tracks.video]))
        for tracks in videos
        if questions.get(tracks.video) and tracks.video in finding.videos
    ]
    compile_model(finding.extended)
    work = _Comparison(finding, tuple(words), seed)
    shown = progress or SilentProgress()
    with several_processes(processes), shown.stage("Questions, both models", total=len(asked)) as advance:
        found = in_processes(work, asked, advance=advance)
    answers = [answer for answers, _ in found for answer in answers]
    refused = [reason for _, reasons in found for reason in reasons]
    notes = [*finding.notes, *(f"Not answered, and left out: {reason}" for reason in dict.fromkeys(refused))]
    return replace(finding, answers=tuple(answers), notes=tuple(notes))


@dataclass(frozen=True)
class _Comparison:
    """Both models asked about one video."""

    finding: Finding
    words: tuple[ChangeWord, ...]
    seed: int

    def __call__(self, asked: tuple[Tracks, tuple[Question, ...]]) -> tuple[list[ComparedAnswer], list[str]]:
        """Answers to the questions, and why others have none."""
        tracks, questions = asked
        models = self.finding.left_out.get(tracks.video, (self.finding.model, self.finding.extended))
        worlds = [self._worlds(tracks, model) for model in models]
        answers, reasons = [], []
        for question in questions:
            try:
                before, after = (ask(facts, question, words=self.words) for facts in worlds)
            except InputError as error:
                reasons.append(f"{tracks.video}, '{question.text}': {error}")
            else:
                answers.append(compared(tracks.video, question, before, after))
        return answers, reasons

    def _worlds(self, tracks: Tracks, model: PhysicsModel) -> PosteriorWorlds:
        posterior = infer(tracks, sampler="laplace", model=model, seed=self.seed, hand_on=False)
        return PosteriorWorlds(posterior, draws=DRAWS)


def compared(video: str, question: Question, before: Answer, after: Answer) -> ComparedAnswer:
    """Two answers to a question side by side."""
    options = _choices(question, before, after) if question.choices else _values(question, before, after)
    return ComparedAnswer(video, question.text, tuple(options))


def _choices(question: Question, before: Answer, after: Answer) -> list[ComparedOption]:
    return [
        ComparedOption(
            asked.text,
            one.probability,
            other.probability,
            chosen_before=_among(one.choice_id, before),
            chosen_after=_among(one.choice_id, after),
            right=None if asked.answer is None else asked.answer == RIGHT,
        )
        for asked, one, other in zip(question.choices, before.choices, after.choices, strict=True)
    ]


def _among(choice: int | str, answer: Answer) -> bool:
    return isinstance(answer.answer, tuple) and choice in answer.answer


def _values(question: Question, before: Answer, after: Answer) -> list[ComparedOption]:
    """Every value that one of the models thinks possible, and the right one, the most probable ones first."""
    known = [] if question.answer is None else [question.answer]
    values = dict.fromkeys([*before.distribution, *after.distribution, *known])
    options = [
        ComparedOption(
            value,
            before.distribution.get(value, 0.0),
            after.distribution.get(value, 0.0),
            chosen_before=value == str(before.answer),
            chosen_after=value == str(after.answer),
            right=value == question.answer if known else None,
        )
        for value in values
    ]
    return sorted(options, key=lambda option: -max(option.before, option.after))
