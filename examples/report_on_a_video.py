"""Write an uncertainty report on a video: report.html, report.json and posterior.nc."""

import sys
from pathlib import Path

import vrdp_prob
from vrdp_prob.datasets import read_questions

DEMO = Path(__file__).parent / "demo"


def main(directory: Path) -> None:
    tracks = vrdp_prob.load(DEMO / "video_00000.mp4")
    questions = read_questions(DEMO / "questions.json")[tracks.video]
    # The fast way, of which the report says how far it can be trusted; given the tracks themselves in place of the
    # posterior, `report` takes a minute for draws that can be.
    posterior = vrdp_prob.infer(tracks, sampler="laplace", hand_on=False)
    written = vrdp_prob.report(
        posterior,
        questions=questions[-4:],
        directory=directory,
        video_file=DEMO / "video_00000.mp4",
    )
    for path in written.files:
        print(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/example_report"))
