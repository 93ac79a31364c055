"""What commands read before their work, and the refusals that come with it."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from vrdp_prob.concepts.perceived.concepts import Concepts
from vrdp_prob.concepts.perceived.storage import read_concepts
from vrdp_prob.concepts.physical import LearnedWord
from vrdp_prob.datasets import read_questions, video_files, video_names
from vrdp_prob.datasets.folder import some
from vrdp_prob.errors import InputError
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.reasoning.vocabulary import ChangeWord, Vocabulary
from vrdp_prob.report.pipeline import check_questions
from vrdp_prob.scene import Question


def scene_range(text: str) -> tuple[int, int]:
    """Scenes A to B-1, written A:B."""
    first, colon, end = text.partition(":")
    if not colon or not first.isdecimal() or not end.isdecimal() or int(first) >= int(end):
        raise InputError(f"--scenes is '{text}'; give A:B with A below B, for example 0:30.")
    return int(first), int(end)


RULES = "rules"
"""Name of perception's own rules, where concepts can be chosen."""


def concepts_at(choice: str) -> Concepts | None:
    """The concepts of a file, None for the rules of perception."""
    return None if choice == RULES else read_concepts(Path(choice))


def check_concepts(concepts: Concepts | None, questions: Iterable[Question], words: Sequence[ChangeWord] = ()) -> None:
    """Refuse questions with a word that the concepts never learned."""
    if concepts is not None:
        for question in questions:
            try:
                concepts.check_question(question, Vocabulary.of(words))
            except InputError as error:
                place = "" if question.source is None else f"{question.source}, question {question.question_id}: "
                raise InputError(f"{place}{error}") from error


def model_at(path: Path | None) -> PhysicsModel | None:
    """The model of a file, None where none is named."""
    return None if path is None else PhysicsModel.read(path)


def words_at(paths: list[Path] | None) -> tuple[LearnedWord, ...]:
    """The learned words of some files."""
    return tuple(LearnedWord.read(path) for path in paths or ())


def questions_of(path: Path, names: list[str], words: Sequence[ChangeWord] = ()) -> dict[str, list[Question]]:
    """The questions about each video, understood as far as that goes before the video is looked at."""
    asked = questions_about(path, names, words)
    for name in names:
        if name not in asked:
            raise InputError(
                f"{path}: there is no question about {name}; "
                "the stem of a scene's 'video_filename' must be the name of the video."
            )
    return asked


def questions_about(path: Path, names: list[str], words: Sequence[ChangeWord] = ()) -> dict[str, list[Question]]:
    """The questions about some videos, at least one of which is asked about, understood as far as that goes."""
    asked = {name: questions for name, questions in read_questions(path).items() if name in names}
    if not asked:
        raise InputError(
            f"{path}: there is no question about {some(names)}; "
            "the stem of a scene's 'video_filename' must be the name of the video."
        )
    for questions in asked.values():
        check_questions(questions, words=words)
    return asked


def videos_at(path: Path) -> dict[str, Path]:
    """The video files of a path by their name."""
    video_names(path)  # refuses a path at which there is nothing
    files = video_files(path)
    if not files:
        raise InputError(
            f"{path}: a tracks folder or an annotation is no video; name the videos, and give this with --positions."
        )
    return files
