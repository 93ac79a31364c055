"""The command line: `vrdp-prob report`, `ask`, `learn-concepts`, `learn-word`, `evaluate`, `discover`, `demo` and more.

Exit code 0: done; 2: input that cannot be used (one line says what, where, and how to mend it); 1: anything else.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from vrdp_prob.command_inputs import (
    RULES,
    check_concepts,
    concepts_at,
    model_at,
    questions_about,
    questions_of,
    scene_range,
    videos_at,
    words_at,
)
from vrdp_prob.command_options import (
    CameraOption,
    CheckpointFolder,
    ConceptsOption,
    Defaults,
    Input,
    Model,
    Noise,
    Processes,
    Quiet,
    Sampler,
    Scenes,
    Seed,
    Video,
    Words,
)
from vrdp_prob.datasets import load, load_all, pictures, video_names
from vrdp_prob.discovery.checking import check_searched, check_video_count
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.page.document import to_document as finding_document
from vrdp_prob.discovery.page.document import write_finding
from vrdp_prob.discovery.page.summary import lines as finding_lines
from vrdp_prob.errors import InputError
from vrdp_prob.evaluation import evaluate
from vrdp_prob.evaluation.compared_answers import with_answers
from vrdp_prob.evaluation.document import table, to_document, write_evaluation
from vrdp_prob.files import check_writable, own_folders
from vrdp_prob.inference import OPTIONS, check_options, default_model
from vrdp_prob.learning_commands import learn_concepts, learn_word
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.progress import progress_display
from vrdp_prob.reasoning import ask, infer
from vrdp_prob.reasoning.adaptive import check_mc_error
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.report.answer_lines import answer_lines
from vrdp_prob.report.pipeline import Report, check_questions
from vrdp_prob.report.pipeline import report as write_report
from vrdp_prob.report.wording import with_names
from vrdp_prob.scene import Choice, Question
from vrdp_prob.version import __version__

UNUSABLE_INPUT = 2
FAILURE = 1
INTERRUPTED = 130
"""What the command-line library makes of Ctrl-C."""
DEFAULT_SAMPLER = "emcee"
SAMPLER_OF_FITS = "laplace"
"""What comes nearest to what discovery does."""

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _tell_version(asked: bool) -> bool:
    if asked:
        print(f"vrdp-prob {__version__}")
        raise typer.Exit
    return asked


@app.callback()
def options(
    *,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_tell_version, is_eager=True)
    ] = False,
) -> None:
    """Fit a rigid-body simulator to a video and answer questions about it with probabilities."""
    del version


@app.command()
def report(
    path: Input,
    *,
    questions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="CLEVRER question file; answered in the report.")
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.")] = Path("vrdp-prob-report"),
    video: Video = None,
    camera: CameraOption = None,
    concepts: ConceptsOption = RULES,
    model: Model = None,
    sampler: Sampler = DEFAULT_SAMPLER,
    noise: Noise = "auto",
    defaults: Defaults = "fixed",
    word: Words = None,
    checkpoint: CheckpointFolder = None,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Write an uncertainty report: report.html, report.json and posterior.nc."""
    progress = progress_display(quiet=quiet)
    check_options(sampler=sampler, noise=noise, defaults=defaults)
    chosen = None if video is None else [video]
    names = video_names(path, chosen)
    own = {names[0]: ""} if len(names) == 1 else own_folders(names)
    for folder in (out, *([] if checkpoint is None else [checkpoint])):
        for name in names:
            check_writable(folder / own[name])
    physics, learned, words = model_at(model), concepts_at(concepts), words_at(word)
    asked = {name: [] for name in names} if questions is None else questions_of(questions, names, words)
    check_concepts(learned, [question for several in asked.values() for question in several], words)
    videos = load_all(
        path,
        videos=chosen,
        camera=camera,
        recognise=None if learned is None else learned.recognise,
        progress=progress,
    )
    files = pictures(path)
    for tracks in videos:
        written = write_report(
            tracks,
            questions=asked[tracks.video],
            directory=out / own[tracks.video],
            video_file=files.get(tracks.video),
            model=physics,
            sampler=sampler,
            noise=noise,
            defaults=defaults,
            words=words,
            checkpoint=None if checkpoint is None else checkpoint / own[tracks.video],
            seed=seed,
            progress=progress,
        )
        if not quiet:
            _tell(written)


@app.command(name="ask")
def ask_question(
    path: Input,
    question: Annotated[str, typer.Argument(metavar="QUESTION", help="In English, CLEVRER's wording.")],
    *,
    choice: Annotated[list[str] | None, typer.Option(metavar="TEXT", help="An option; repeat for each.")] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Also what the answer hangs on, and what would settle it.")
    ] = False,
    mc_error: Annotated[
        float | None, typer.Option(metavar="SHARE", help="Monte Carlo error to reach, for example 0.01.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on standard output.")] = False,
    video: Video = None,
    camera: CameraOption = None,
    concepts: ConceptsOption = RULES,
    model: Model = None,
    sampler: Sampler = DEFAULT_SAMPLER,
    noise: Noise = "auto",
    defaults: Defaults = "fixed",
    word: Words = None,
    checkpoint: CheckpointFolder = None,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Answer one question with probabilities."""
    progress = progress_display(quiet=quiet)
    if not question.strip():
        raise InputError('the question is empty; ask one, for example "What will happen next?" with --choice options.')
    asked = Question(question, choices=tuple(Choice(number, text) for number, text in enumerate(choice or ())))
    check_options(sampler=sampler, noise=noise, defaults=defaults)
    if mc_error is not None:
        check_mc_error(mc_error)
    if checkpoint is not None:
        check_writable(checkpoint)
    physics, learned, words = model_at(model), concepts_at(concepts), words_at(word)
    check_question(asked, words=words)
    check_concepts(learned, [asked], words)
    recognise = None if learned is None else learned.recognise
    tracks = load(path, video=video, camera=camera, recognise=recognise, progress=progress)
    check_question(asked, tracks=tracks, words=words)
    posterior = infer(
        tracks,
        sampler=sampler,
        model=physics,
        noise=noise,
        defaults=defaults,
        checkpoint=checkpoint,
        seed=seed,
        progress=progress,
    )
    answer = ask(posterior, asked, mc_error=mc_error, words=words, progress=progress)
    explanation = answer.explain() if explain else None
    if as_json:
        told = {} if explanation is None else {"explanation": explanation.to_document()}
        limits = {"converged": posterior.convergence.converged, "warnings": list(posterior.warnings)}
        print(json.dumps({**answer.to_document(), **limits, **told}, allow_nan=False))
    else:
        reasons = explanation.sentences if explanation is not None else ()
        misfit = () if posterior.misfit is None else posterior.misfit.sentences
        lines = answer_lines(answer, tracks.bodies, posterior.warnings, misfit=misfit)
        print("\n".join([*lines, *(with_names(reason, tracks.bodies) for reason in reasons)]))


@app.command(name="discover")
def discover_causes(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="A tracks folder, or a folder of annotations or videos.")
    ],
    *,
    questions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="CLEVRER question file: which answers does the finding change?")
    ] = None,
    searched: Annotated[
        int | None,
        typer.Option(
            "--search-videos", metavar="N", help="Look for causes in so many videos, and ask all for those found there."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the finding.")] = Path("vrdp-prob-finding"),
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on standard output.")] = False,
    camera: CameraOption = None,
    checkpoint: CheckpointFolder = None,
    model: Model = None,
    processes: Processes = None,
    sampler: Annotated[
        str,
        typer.Option(
            metavar="|".join(OPTIONS["sampler"]), help="Of no effect here: causes are compared by fits, without draws."
        ),
    ] = SAMPLER_OF_FITS,
    word: Words = None,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Find what the simulation gets wrong: finding.html, finding.json and the extended model.toml."""
    progress = progress_display(quiet=quiet)
    check_options(sampler=sampler)
    for place in (out, *([] if checkpoint is None else [checkpoint])):
        check_writable(place)
    physics = model_at(model)
    names, words = video_names(folder), words_at(word)
    check_video_count(names, source=folder)
    check_searched(searched, source="--search-videos")
    asked = {} if questions is None else questions_about(questions, names, words)
    videos = load_all(folder, camera=camera, progress=progress)
    for tracks in videos:
        check_questions(asked.get(tracks.video, ()), tracks=tracks, words=words)
    finding = discover(
        videos,
        model=physics,
        seed=seed,
        searched=searched,
        processes=processes,
        progress=progress,
        checkpoint=checkpoint,
    )
    if asked:
        finding = with_answers(finding, videos, asked, words=words, seed=seed, processes=processes, progress=progress)
    if sampler != SAMPLER_OF_FITS:
        note = f"Causes are compared by fits, without draws: --sampler {sampler} changed nothing."
        finding = replace(finding, notes=(*finding.notes, note))
    files = write_finding(finding, out)
    if as_json:
        print(json.dumps(finding_document(finding, model=files.model), allow_nan=False))
    elif not quiet:
        print("\n".join([*finding_lines(finding), *(str(file) for file in files)]))


@app.command(name="evaluate")
def evaluate_answers(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A tracks folder, or a folder of videos.")],
    *,
    questions: Annotated[Path, typer.Option(metavar="FILE", help="CLEVRER question file with the right answers.")],
    scenes: Scenes = None,
    source: Annotated[
        str | None, typer.Option("--input", metavar="tracks|videos", help="By default tracks where there are any.")
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder of the results; the same call again goes on from what is there.")
    ] = Path("vrdp-prob-evaluation"),
    processes: Processes = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster that does the work.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on standard output.")] = False,
    camera: CameraOption = None,
    concepts: ConceptsOption = RULES,
    model: Model = None,
    sampler: Sampler = "laplace",
    word: Words = None,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Answer all questions of a file and score the answers: evaluation.html and evaluation.json."""
    check_writable(out)
    evaluation = evaluate(
        folder,
        questions,
        scenes=None if scenes is None else scene_range(scenes),
        source=source,
        camera=camera,
        concepts=None if concepts == RULES else Path(concepts),
        model=model_at(model),
        sampler=sampler,
        seed=seed,
        words=words_at(word),
        out=out,
        processes=processes,
        dask=dask,
        progress=progress_display(quiet=quiet),
    )
    files = write_evaluation(evaluation, out)
    if as_json:
        print(json.dumps(to_document(evaluation), allow_nan=False))
    elif not quiet:
        print("\n".join([*table(evaluation), *(str(file) for file in files)]))


app.command(name="learn-word")(learn_word)
app.command(name="learn-concepts")(learn_concepts)


@app.command()
def demo(
    *,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.")] = Path("vrdp-prob-demo"),
    model: Model = None,
    sampler: Sampler = DEFAULT_SAMPLER,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Run the main job on the example that ships: a short video with its questions."""
    folder = demo_folder()
    video = next(folder.glob("*.mp4"))
    report(video, questions=folder / "questions.json", out=out, model=model, sampler=sampler, seed=seed, quiet=quiet)


@app.command(name="calibrate-camera")
def calibrate_camera(
    videos: Annotated[
        list[Path], typer.Argument(metavar="VIDEO...", help="Videos of one fixed camera, or a folder of them.")
    ],
    *,
    positions: Annotated[
        Path, typer.Option(metavar="PATH", help="Known plane positions: a tracks folder, or a folder of annotations.")
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Camera file to write.")] = Path("camera.json"),
    quiet: Quiet = False,
) -> None:
    """Estimate the camera from videos whose objects' plane positions are known (the paper uses 20)."""
    from vrdp_prob.perception import calibrate_from_videos  # noqa: PLC0415 - OpenCV is loaded only for videos

    progress = progress_display(quiet=quiet)
    check_writable(out.parent)
    files = {name: file for path in videos for name, file in videos_at(path).items()}
    known = {tracks.video: tracks for tracks in load_all(positions)}
    unknown = sorted(set(files) - set(known))
    if unknown:
        raise InputError(f"{positions}: no positions of {unknown[0]}; the name of a video is the stem of its file.")
    camera = calibrate_from_videos(list(files.values()), [known[name] for name in files], progress=progress)
    camera.write(out)
    if not quiet:
        print(f"{out}: reprojection error {camera.pixel_sd:.2f} pixels per coordinate", file=sys.stderr)


@app.command(name="compile")
def compile_simulator(model: Model = None) -> None:
    """Compile the simulator now, once per machine, rather than in the first run."""
    compile_model(default_model() if model is None else model_at(model))


def demo_folder() -> Path:
    """Folder of the example that ships: in the installed package, or in the repository it is installed from."""
    package = Path(__file__).parent
    for folder in (package / "demo", package.parent / "examples" / "demo"):
        if folder.is_dir():
            return folder
    raise InputError("the example is not installed; install the package from its wheel or its repository.")


def main() -> None:
    """Entry point of the command `vrdp-prob`."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run a command line.

    Parameters
    ----------
    arguments
        The words after `vrdp-prob`; without any the help is printed.

    Returns
    -------
    int
        The exit code: 0 done, 2 unusable input, 1 interrupted.
    """
    try:
        result = app(arguments or ["--help"], prog_name="vrdp-prob", standalone_mode=False)
    except InputError as error:
        return _refuse(str(error))
    except (KeyboardInterrupt, typer.Abort):
        return _interrupted()
    except Exception as error:
        # usage errors of the command-line library, whose classes moved between its versions
        if not hasattr(error, "format_message"):
            raise
        return _refuse(f"{error.format_message().rstrip('.')}; see vrdp-prob --help.")
    if result == INTERRUPTED:
        return _interrupted()
    return result if isinstance(result, int) else 0


def _interrupted() -> int:
    print("vrdp-prob: interrupted; nothing half-written was left behind.", file=sys.stderr)
    return FAILURE


def _refuse(message: str) -> int:
    print(f"vrdp-prob: {' '.join(message.split())}", file=sys.stderr)
    return UNUSABLE_INPUT


def _tell(written: Report) -> None:
    for line in written.summary:
        print(line)
    for file in written.files:
        print(file)


if __name__ == "__main__":
    main()
