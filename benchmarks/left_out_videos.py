"""Whether left-out videos are predicted as they would be by fits that never saw them.

    python benchmarks/left_out_videos.py [--docs docs] [--json FILE] [--causes a,b] [--videos 6] [--bodies 3] [--seed 1]

`discover` takes a video's part from the joint Gaussian of all and fits nothing again: that is fast, and compared here.
The reference fits the other videos anew, with and without the cause: the gain is what the video adds to the log
evidence, and the first part of the video is then fitted by itself, under what the others have told, from the beginning.
Each data set hides one cause, as those of `benchmarks/discovery.py` do.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import torch
from _discovery_tasks import handed_over
from _extension import first_part, forecast
from _page import page_parser, publish, table_row
from _resumable import Result, measured

from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.selection.forecast import SEEN_SHARE
from vrdp_prob.discovery.selection.trials import Trial, with_own_population
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos import SharedFit, fit_together, learned_model
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.rollout import compile_model
from vrdp_prob.scene import Tracks

RESULTS = Path("out/left_out_videos")
CAUSES = ("surface_tilt", "linear_drag", "contact_friction")
EFFECT_SIZE = 3.0


@dataclass(frozen=True)
class Task:
    """A data set with a hidden cause."""

    cause: str
    setting: Setting
    seed: int

    @property
    def key(self) -> str:
        """By which its result is found again."""
        return f"{self.cause}, {self.setting.videos} videos x {self.setting.bodies}, seed {self.seed}"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = page_parser(__doc__, RESULTS)
    parser.add_argument("--causes", default=",".join(CAUSES), help="what is hidden, one in each data set")
    parser.add_argument("--videos", type=int, default=6)
    parser.add_argument("--bodies", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1, help="of the data")
    options = parser.parse_args(arguments)
    compile_model(default_model())
    setting = Setting(videos=options.videos, bodies=options.bodies)
    tasks = [Task(cause, setting, options.seed) for cause in options.causes.split(",")]
    results = measured(
        compared,
        {task.key: task for task in tasks},
        options.results / "results.jsonl",
        field="key",
        label="Data sets",
        processes=options.processes,
    )
    publish("\n".join(_table(results)), "left-out-videos.md", {"results": results}, options)
    return 0


def compared(task: Task) -> Result:
    """What each video gains by the cause, and how far off its last part is predicted, in both ways."""
    torch.set_num_threads(1)
    data = hide([task.cause], seed=task.seed, effect_size=EFFECT_SIZE, setting=task.setting)
    videos = handed_over(data)
    fitted = partial(fit_together, seed=0, model_error=False)
    base = Trial((), with_own_population(fitted(videos, model=default_model())))
    cause = known_effects()[task.cause]()
    extended = base.and_causes([cause], fitted(videos, model=base.fit.extended(cause)))
    rows = []
    for index, tracks in enumerate(videos):
        others = [*videos[:index], *videos[index + 1 :]]
        without, with_it = (fitted(others, model=one.fit.model) for one in (base, extended))
        added = [whole.fit.log_evidence - part.log_evidence for whole, part in ((base, without), (extended, with_it))]
        rows.append(
            {
                "video": tracks.video,
                "gain": float(extended.fitted_density[index] - base.fitted_density[index]),
                "refitted_gain": added[1] - added[0],
                "errors": [one.held_out.by_video[index].rmse for one in (base, extended)],
                "refitted_errors": [_error(tracks, _told_by(fit)) for fit in (without, with_it)],
            }
        )
    return {"key": task.key, "cause": task.cause, "videos": rows}


def _told_by(fit: SharedFit) -> PhysicsModel:
    """What some videos tell, how much bodies differ learned from them alone."""
    return learned_model(with_own_population(fit))


def _error(tracks: Tracks, model: PhysicsModel) -> float:
    """Root mean square error (m, per axis) in the last part of a video, whose first part is fitted from scratch."""
    seen, longer = first_part(tracks, SEEN_SHARE)
    squares = (forecast(seen, longer, model) - longer.positions)[longer.times > seen.times[-1]] ** 2
    return float(np.sqrt(np.nanmean(squares)))


def _table(results: Sequence[Result]) -> list[str]:
    lines = [
        table_row("hidden", "gain, nats", "by fits anew", "largest difference of a video", "error, mm", "by fits anew"),
        table_row(*["---"] * 6),
    ]
    for result in results:
        rows = result["videos"]
        gains, anew = (np.array([row[name] for row in rows]) for name in ("gain", "refitted_gain"))
        errors, errors_anew = (
            [1e3 * float(np.median([row[name][k] for row in rows])) for k in (0, 1)]
            for name in ("errors", "refitted_errors")
        )
        lines.append(
            table_row(
                result["cause"],
                f"{gains.sum():.1f}",
                f"{anew.sum():.1f}",
                f"{np.abs(gains - anew).max():.1f}",
                *(f"{before:.1f} → {after:.1f}" for before, after in (errors, errors_anew)),
            )
        )
    return lines


if __name__ == "__main__":
    sys.exit(main())
