"""The main job in one call: infer, answer, and write the report."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from vrdp_prob.errors import InputError
from vrdp_prob.files import check_writable, write_atomically
from vrdp_prob.inference import Posterior, infer
from vrdp_prob.inference.storage import fill_file
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.perception.video import read_frames
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.reasoning import Answer, PosteriorWorlds, ask
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.reasoning.vocabulary import ChangeWord
from vrdp_prob.report.content import ReportContent
from vrdp_prob.report.from_posterior import build
from vrdp_prob.report.summary import summary
from vrdp_prob.report.writing import write_report
from vrdp_prob.scene import Question, Tracks


@dataclass(frozen=True)
class Report:
    """A report that was written.

    Parameters
    ----------
    posterior
        What was learned.
    answers
        The answers, in the order asked.
    content
        What the report says, as plain data.
    files
        Paths of the page, the document and the posterior.
    """

    posterior: Posterior
    answers: tuple[Answer, ...]
    content: ReportContent
    files: tuple[Path, Path, Path]

    @property
    def summary(self) -> list[str]:
        """Sentences of the report's opening paragraph."""
        return summary(self.content)


def report(
    source: Tracks | Posterior,
    *,
    directory: Path | str,
    questions: Sequence[Question | str] = (),
    video_file: Path | str | None = None,
    sampler: str = "emcee",
    model: PhysicsModel | None = None,
    noise: str = "auto",
    defaults: str = "fixed",
    words: Sequence[ChangeWord] = (),
    checkpoint: Path | str | None = None,
    seed: int = 0,
    progress: ProgressDisplay | None = None,
) -> Report:
    """Write `report.html`, `report.json` and `posterior.nc`.

    Parameters
    ----------
    source
        Tracks of a video, or a posterior that was inferred from them before.
    directory
        Folder of the report, made where it is missing.
    questions
        Questions to answer.
    video_file
        The video itself, for the pictures in the page.
    sampler, model, noise, defaults, checkpoint, seed
        How the posterior is drawn, where `source` is not one yet; see `vrdp_prob.infer`.
    words
        Learned words that the questions may use.
    progress
        Who follows the work.

    Raises
    ------
    InputError
        If the folder cannot be written, the video file is not there, or a question cannot be answered (see
        `vrdp_prob.reasoning.ask`). What can be told without the posterior is told before the work.
    """
    if not isinstance(source, Tracks | Posterior):
        raise InputError(f"a {type(source).__name__} cannot be reported; give tracks, which vrdp_prob.load reads.")
    if isinstance(questions, str | Question):
        raise InputError("questions is a single question; give a list, even of one.")
    directory, progress = Path(directory), progress or SilentProgress()
    check_writable(directory)
    if video_file is not None and not Path(video_file).is_file():
        raise InputError(f"{video_file}: there is no such video file; check the path.")
    check_questions(questions, tracks=source if isinstance(source, Tracks) else source.tracks, words=words)
    if isinstance(source, Posterior):
        posterior = source
    else:
        posterior = infer(
            source,
            sampler=sampler,
            model=model,
            noise=noise,
            defaults=defaults,
            checkpoint=checkpoint,
            seed=seed,
            progress=progress,
        )
    worlds = PosteriorWorlds(posterior)
    answers = []
    with progress.stage("Questions", total=len(questions)) as advance:
        for number, question in enumerate(questions, start=1):
            with _named(question, number):
                answers.append(ask(worlds, question, words=words))
            advance(1)
    with progress.stage("Report") as advance:
        frames = None if video_file is None else read_frames(Path(video_file)).frames
        content = build(posterior, answers, worlds=worlds, frames=frames, words=words)
        saved = directory / "posterior.nc"
        with write_atomically(saved) as new_posterior:
            fill_file(posterior, new_posterior)
            written = write_report(content, directory)
    return Report(posterior, tuple(answers), content, (written.page, written.document, saved))


def check_questions(
    questions: Sequence[Question | str], *, tracks: Tracks | None = None, words: Sequence[ChangeWord] = ()
) -> None:
    """Refuse questions that could not be answered, before any work on the video.

    Parameters
    ----------
    questions
        Questions to answer.
    tracks
        What was seen, where it is known already; see `vrdp_prob.reasoning.checking.check_question`.
    words
        Learned words that the questions may use.

    Raises
    ------
    InputError
        With the file and the question's name, or its place (counting from 1), if one cannot be answered.
    """
    for number, question in enumerate(questions, start=1):
        with _named(question, number):
            check_question(question, tracks=tracks, words=words)


@contextmanager
def _named(question: Question | str, number: int) -> Iterator[None]:
    """Say in a refusal which question is refused, and where it was read from."""
    try:
        yield
    except InputError as error:
        stated = question if isinstance(question, Question) else Question(str(question))
        source = "" if stated.source is None else f"{stated.source}, "
        name = number if stated.question_id is None else stated.question_id
        raise InputError(f"{source}question {name}: {error}") from error
