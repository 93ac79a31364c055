"""Arguments and options that several commands take."""

from pathlib import Path
from typing import Annotated

import typer

from vrdp_prob.inference import OPTIONS

Input = Annotated[Path, typer.Argument(metavar="INPUT", help="A video, a tracks folder, or a CLEVRER annotation file.")]
Model = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.toml", help="Physics model; by default the base model with a friction of its own for every body."
    ),
]
Sampler = Annotated[
    str,
    typer.Option(
        metavar="|".join(OPTIONS["sampler"]),
        help="How the posterior is drawn; laplace takes seconds, and emcee goes on where it cannot be trusted (not in "
        "evaluate and learn-word).",
    ),
]
Noise = Annotated[
    str,
    typer.Option(
        metavar="|".join(OPTIONS["noise"]), help="Measurement errors; auto: Student-t where the tracks show outliers."
    ),
]
Defaults = Annotated[
    str,
    typer.Option(
        metavar="|".join(OPTIONS["defaults"]),
        help="Masses and restitutions that the data say nothing about: default values, or drawn from their prior.",
    ),
]
CheckpointFolder = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Keeps what is done; the same command, run again after a kill, goes on from it."),
]
Seed = Annotated[int, typer.Option(min=0, help="Same seed, same numbers.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress bars, no closing lines.")]
CameraOption = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|clevrer",
        help="Camera file; by default camera.json beside the video or in its parent folder, or in the tracks folder.",
    ),
]
Words = Annotated[
    list[Path] | None,
    typer.Option("--word", metavar="FILE", help="A learned word that questions may use; repeat for each."),
]
Scenes = Annotated[
    str | None, typer.Option(metavar="A:B", help="Scenes A to B-1 of the question file; all by default.")
]
Processes = Annotated[int | None, typer.Option(metavar="N", min=1, help="Processes; by default one per core.")]
ConceptsOption = Annotated[
    str,
    typer.Option(
        "--concepts",
        metavar="FILE|rules",
        help="What objects look like: concepts learned by learn-concepts, or the rules of perception.",
    ),
]
Video = Annotated[str | None, typer.Option(metavar="ID", help="Which video of a folder of several.")]
