"""Write an uncertainty report on a video: report.html, report.json and posterior.nc."""

import sys
from pathlib import Path

import vrdp_prob
from vrdp_prob.datasets import read_questions

DEMO = Path(__file__).parent / "demo"


def main(directory: Path) -> None:
    tracks = vrdp_prob.load(DEMO / "video_00000.mp4")
    questions = read_questions(DEMO / "questions.json")[tracks.video]
    written = vrdp_prob.report(
        tracks,
        questions=questions[-4:],
        directory=directory,
        video_file=DEMO / "video_00000.mp4",
        sampler="laplace",
    )
    for path in written.files:
        print(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/example_report"))
