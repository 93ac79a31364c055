"""`vrdp-prob discover`: what it asks for, what it prints and writes, and what it refuses before any work."""

import errno
import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
from command_line import OBJECTS, TRACKS_HEADER, refused, two_discs

from tests.discovery.findings import EVERY_KIND, named, nothing, unknown
from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob import InputError, PhysicsModel, cli
from vrdp_prob.discovery.finding import Finding
from vrdp_prob.discovery.page import document
from vrdp_prob.discovery.page.wording import MINUS
from vrdp_prob.report import schema
from vrdp_prob.scene import Shape

FILES = ["finding.html", "finding.json", "model.toml"]


def fill(folder: Path, videos: tuple[str, ...]) -> Path:
    """Write a tracks folder of some videos."""
    folder.mkdir(exist_ok=True)
    rows, objects = two_discs().splitlines()[1:], OBJECTS.splitlines()
    tracks = [TRACKS_HEADER, *(row.replace("v,", f"{video},", 1) for video in videos for row in rows)]
    bodies = [objects[0], *(row.replace("v,", f"{video},", 1) for video in videos for row in objects[1:])]
    (folder / "tracks.csv").write_text("\n".join(tracks) + "\n")
    (folder / "objects.csv").write_text("\n".join(bodies) + "\n")
    return folder


@pytest.fixture
def videos(tmp_path: Path) -> Path:
    """A tracks folder of three videos."""
    return fill(tmp_path / "videos", ("a", "b", "c"))


def let_find(monkeypatch: pytest.MonkeyPatch, finding: Finding) -> dict[str, object]:
    """Let the search find something, and keep what it was called with."""
    given: dict[str, object] = {}

    def found(videos: list[object], **options: object) -> Finding:
        given.update(options, videos=videos)
        return finding

    monkeypatch.setattr(cli, "discover", found)
    return given


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_writes_its_three_files(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    finding = EVERY_KIND[kind]()
    let_find(monkeypatch, finding)
    out = tmp_path / "out"
    assert cli.run(["discover", str(videos), "--out", str(out)]) == 0
    captured = capsys.readouterr()
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert captured.out.splitlines()[-3:] == [str(out / name) for name in FILES]
    assert captured.err == ""
    written = json.loads((out / "finding.json").read_text())
    jsonschema.validate(written, schema("finding"))
    assert PhysicsModel.read(written["model"]).effects == PhysicsModel.read(out / "model.toml").effects
    assert [effect.name for effect in PhysicsModel.read(written["model"]).effects] == [
        effect.name for effect in finding.extended.effects
    ]


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_prints_exactly_one_document(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    let_find(monkeypatch, EVERY_KIND[kind]())
    out = tmp_path / "out"
    assert cli.run(["discover", str(videos), "--json", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) == 1
    assert json.loads(printed, parse_constant=pytest.fail) == json.loads((out / "finding.json").read_text())


def test_what_a_terminal_shows_of_named_causes(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    let_find(monkeypatch, named())
    assert cli.run(["discover", str(videos), "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.splitlines()[:-3] == [
        "These 12 videos show that the table slopes by 0.15 degrees, down towards x = 0.83, y = -0.56, and that bodies "
        "that touch rub on each other, with a friction coefficient of 0.18.",
        "  surface tilt: probability > 99 %; left-out videos: +231 ± 33 nats, error 12 to 5.9 mm (noise 3.0 mm), a "
        "factor of 0.48 (0.40 to 0.57)",
        "      tilt x 0.00217 (95 %: 0.00188 to 0.00246)",
        f"      tilt y {MINUS}0.00147 (95 %: {MINUS}0.00176 to {MINUS}0.00117)",
        "  contact friction: probability 94 %; left-out videos: +87 ± 12 nats, error 5.9 to 3.4 mm (noise 3.0 mm), a "
        "factor of 0.57 (0.54 to 0.62)",
        "      contact friction 0.181 (95 %: 0.153 to 0.212)",
        "  all named causes: left-out videos: +319 ± 68 nats, error 12 to 3.4 mm (noise 3.0 mm), a factor of 0.27 "
        "(0.21 to 0.35)",
        "Also possible: wind (31 %).",
        "Of six checks of the residuals, two fail under the model that was given, and one fails under the extended "
        "one.",
        "note: Two videos end before 1 s; their errors at 1 s are not counted.",
    ]


def test_what_a_terminal_shows_of_nothing_and_of_the_unknown(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["discover", str(videos), "--out", str(tmp_path / "out")]
    let_find(monkeypatch, nothing())
    assert cli.run(command) == 0
    told = capsys.readouterr().out
    assert told.startswith("The model explains these three videos.\n")
    assert "  surface tilt: tilt x ≤ 0.00031, tilt y ≤ 0.00028\n" in told
    let_find(monkeypatch, unknown())
    assert cli.run(command) == 0
    told = capsys.readouterr().out
    assert told.startswith("These 12 videos show something that no cause of the catalogue explains.\n")
    assert "  a description, not a cause: a_x = 0.041 sin(6.2 t) - 0.11 v_y; a_y = 0.11 v_x\n" in told
    assert "  a description, not a cause: J = 0.12 J_n s\n" in told


def test_quiet_prints_nothing(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    let_find(monkeypatch, named())
    assert cli.run(["discover", str(videos), "--quiet", "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr() == ("", "")


def test_options_reach_the_search(videos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = let_find(monkeypatch, nothing())
    PhysicsModel.base().write(tmp_path / "base.toml")
    monkeypatch.chdir(tmp_path)
    command = ["discover", str(videos), "--model", "base.toml", "--seed", "7", "--sampler", "nuts", "--quiet"]
    assert cli.run([*command, "--search-videos", "3"]) == 0
    assert [tracks.video for tracks in given["videos"]] == ["a", "b", "c"]
    assert given["model"].name == "base"
    assert given["seed"] == 7
    assert given["searched"] == 3
    notes = json.loads(Path("vrdp-prob-finding/finding.json").read_text())["notes"]
    assert notes == ["Causes are compared by fits, without draws: --sampler nuts changed nothing."]
    assert sorted(path.name for path in (tmp_path / "vrdp-prob-finding").iterdir()) == FILES


def asked_in(path: Path, video: str, program: list[str]) -> Path:
    """A question file about one video."""
    question = {"question_id": 0, "question": "How many objects are there?", "program": program, "answer": "2"}
    path.write_text(json.dumps([{"video_filename": f"{video}.mp4", "questions": [question]}]))
    return path


@pytest.mark.slow
def test_questions_are_answered_with_both_models(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    let_find(monkeypatch, replace(named(), videos=("a", "b", "c")))
    questions = asked_in(tmp_path / "questions.json", "b", ["objects", "count"])
    command = ["discover", str(videos), "--questions", str(questions), "--processes", "1", "--out", str(tmp_path)]
    assert cli.run(command) == 0
    assert (
        "Of one question about these videos, none is answered otherwise with the extended model; 1 of 1 answers are"
        in (capsys.readouterr().out)
    )
    (answer,) = json.loads((tmp_path / "finding.json").read_text())["answers"]
    assert (answer["video"], answer["differs"]) == ("b", False)
    assert (answer["options"][0]["words"], answer["options"][0]["right"]) == ("2", True)


@pytest.mark.parametrize(
    ("video", "program", "words"),
    [
        ("d", ["objects", "count"], "there is no question about a, b, c"),
        ("b", ["objects", "total"], "question 0: "),
        ("b", ["objects", "filter_color", "green", "unique", "query_shape"], "question 0: "),
    ],
)
def test_questions_that_cannot_be_answered_are_refused(
    videos: Path, capsys: pytest.CaptureFixture[str], video: str, program: list[str], words: str
) -> None:
    questions = asked_in(videos.parent / "questions.json", video, program)
    assert words in refused(capsys, "discover", videos, "--questions", questions, "--out", videos.parent / "out")
    assert not (videos.parent / "out").exists()


@pytest.mark.parametrize(("names", "there_are"), [(("a",), "is 1 video"), (("a", "b"), "are 2 videos")])
def test_too_few_videos_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], names: tuple[str, ...], there_are: str
) -> None:
    line = refused(capsys, "discover", fill(tmp_path / "few", names), "--out", tmp_path / "out")
    assert f"few: there {there_are}; what a cause is worth is measured by leaving out whole videos" in line
    assert line.endswith("give at least 3 of the same table.")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--model", "{folder}/none.toml"], "none.toml: the model file cannot be read"),
        (["--sampler", "gibbs"], "sampler 'gibbs' is not known"),
        (["--out", "{folder}/tracks.csv"], "tracks.csv"),
        (["--camera", "{folder}/none.json"], "none.json"),
        (["--seed", "-1"], "--seed"),
        (["--search-videos", "2"], "--search-videos is 2; give a whole number of at least 3"),
    ],
)
def test_options_are_refused_before_the_search(
    videos: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, options: list[str], message: str
) -> None:
    monkeypatch.setattr(cli, "discover", lambda *_arguments, **_options: pytest.fail("expensive work"))
    assert message in refused(capsys, "discover", videos, *(word.format(folder=videos) for word in options))


def test_a_folder_without_tracks_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "empty").mkdir()
    assert "holds no tracks.csv" in refused(capsys, "discover", tmp_path / "empty")
    assert "no such file or folder" in refused(capsys, "discover", tmp_path / "none")
    assert "FOLDER" in refused(capsys, "discover")


def test_what_the_search_refuses_leaves_the_old_files(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: object, **_options: object) -> None:
        raise InputError("video a: nothing moves; give videos in which something does.")

    monkeypatch.setattr(cli, "discover", refuse)
    old = write_old_files(tmp_path / "out")
    assert "nothing moves" in refused(capsys, "discover", videos, "--out", tmp_path / "out", "--json")
    assert {path.name: path.read_text() for path in (tmp_path / "out").iterdir()} == old


@pytest.mark.parametrize("failing", ["render", "to_document"])
def test_a_finding_that_cannot_be_written_leaves_the_old_one(
    videos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    def fail(*_arguments: object, **_options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    let_find(monkeypatch, named())
    old = write_old_files(tmp_path / "out")
    monkeypatch.setattr(document, failing, fail)
    with pytest.raises(OSError, match="No space"):
        cli.run(["discover", str(videos), "--out", str(tmp_path / "out"), "--quiet"])
    assert {path.name: path.read_text() for path in (tmp_path / "out").iterdir()} == old


def test_a_folder_in_the_place_of_a_file_is_refused(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    let_find(monkeypatch, named())
    (tmp_path / "out" / "model.toml").mkdir(parents=True)
    line = refused(capsys, "discover", videos, "--out", tmp_path / "out")
    assert "model.toml: the file cannot be written, a folder has its name" in line
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["model.toml"]


def write_old_files(folder: Path) -> dict[str, str]:
    """Files of an earlier finding."""
    folder.mkdir()
    for name in FILES:
        (folder / name).write_text("old")
    return dict.fromkeys(FILES, "old")


def test_finds_what_is_hidden_in_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From the folder to the files, with nothing in the place of the search."""
    setting = Setting(videos=3, bodies=2, frames=40, shapes=(Shape.CYLINDER,), late=0.0)
    hide(["surface_tilt"], seed=1, effect_size=8.0, setting=setting).write(tmp_path / "videos")
    arguments = ["discover", str(tmp_path / "videos"), "--out", str(tmp_path / "out"), "--json", "--quiet"]
    assert cli.run([*arguments, "--processes", "1"]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.validate(found, schema("finding"))
    assert (found["verdict"], found["causes"][0]["name"]) == ("named", "surface_tilt")
    assert found["causes"][0]["held_out_gain"]["elpd_difference"] > 0
    assert found == json.loads((tmp_path / "out" / "finding.json").read_text(encoding="utf-8"))
    model = PhysicsModel.read(found["model"])
    assert model.effects[-1].name == "surface_tilt"
    assert "surface tilt" in (tmp_path / "out" / "finding.html").read_text(encoding="utf-8")
    asked = ["ask", str(tmp_path / "videos"), "How many collisions happen?", "--video", "v01", "--sampler", "laplace"]
    assert cli.run([*asked, "--model", found["model"], "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)["distribution"]
