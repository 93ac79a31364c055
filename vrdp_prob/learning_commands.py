"""The commands that learn words: `vrdp-prob learn-word` and `vrdp-prob learn-concepts`."""

from pathlib import Path
from typing import Annotated

import typer

from vrdp_prob.command_inputs import model_at, scene_range
from vrdp_prob.command_options import CameraOption, CheckpointFolder, Model, Processes, Quiet, Sampler, Scenes, Seed
from vrdp_prob.concepts.perceived import from_files as perceived
from vrdp_prob.concepts.perceived.storage import write_concepts
from vrdp_prob.concepts.physical import from_files as physical
from vrdp_prob.files import check_file, check_writable
from vrdp_prob.progress import progress_display


def learn_word(
    word: Annotated[str, typer.Argument(metavar="WORD", help="As in 'if the cube were WORD'.")],
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A tracks folder, or a folder of videos.")],
    *,
    questions: Annotated[Path, typer.Option(metavar="FILE", help="CLEVRER question file with the right answers.")],
    scenes: Scenes = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="File of the word; by default WORD.json.")] = None,
    processes: Processes = None,
    camera: CameraOption = None,
    model: Model = None,
    sampler: Sampler = "laplace",
    checkpoint: CheckpointFolder = None,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Learn a word for a change of an object from the questions that use it: what it changes, and by how much."""
    file = Path(f"{word}.json") if out is None else out
    check_file(file)
    if checkpoint is not None:
        check_writable(checkpoint)
    learned = physical.learn_from_files(
        word,
        folder,
        questions,
        scenes=None if scenes is None else scene_range(scenes),
        camera=camera,
        model=model_at(model),
        sampler=sampler,
        checkpoint=checkpoint,
        seed=seed,
        processes=processes,
        progress=progress_display(quiet=quiet),
    )
    learned.write(file)
    if not quiet:
        print("\n".join([*learned.summary, str(file)]))


def learn_concepts(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A folder of videos.")],
    *,
    questions: Annotated[Path, typer.Option(metavar="FILE", help="CLEVRER question file with the right answers.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File of the concepts.")] = Path("vrdp-prob.concepts"),
    scenes: Scenes = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keeps what is done, to go on from; by default a folder beside the file."),
    ] = None,
    processes: Processes = None,
    camera: CameraOption = None,
    device: Annotated[
        str, typer.Option(metavar="cpu|cuda", help="Where the networks learn: processor, or GPU.")
    ] = "cpu",
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Learn what colors, materials, shapes, motion and events look like from questions and answers."""
    check_file(out)
    learned = perceived.learn_from_files(
        folder,
        questions,
        scenes=None if scenes is None else scene_range(scenes),
        camera=camera,
        seed=seed,
        device=device,
        checkpoint=checkpoint or out.with_name(f"{out.name}-checkpoint"),
        processes=processes,
        progress=progress_display(quiet=quiet),
    )
    write_concepts(out, learned.concepts)
    if not quiet:
        print("\n".join([*learned.lines, str(out)]))
