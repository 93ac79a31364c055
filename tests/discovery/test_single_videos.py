"""Where a fit has lost its way, single videos tell the cause."""

from unittest.mock import create_autospec

import pytest

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.candidates import single_videos
from vrdp_prob.discovery.candidates.single_videos import causes_of_lost_videos
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.effects.clock_error import ClockError
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.material_friction import MaterialFriction
from vrdp_prob.models.effects.pair_force import PairForce
from vrdp_prob.models.effects.slip_to_roll import SlipToRoll
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt


def test_of_no_lost_video_nothing_is_told() -> None:
    _, fit = fitted(seed=1)
    assert causes_of_lost_videos(fit, [], [SurfaceTilt()], {"surface_tilt"}, 6.0, seed=0) == []


GAINS = {
    ("contact_friction",): 5.0,
    ("slip_to_roll",): 15.0,
    ("pair_force",): 30.0,
    ("surface_tilt",): 10.0,
    ("contact_friction", "slip_to_roll"): 200.0,
}
"""What searches with some causes gain (nats) in each video."""


def _with_gains(explains: list[tuple[str, ...]], monkeypatch: pytest.MonkeyPatch) -> dict[int, list[str]]:
    """Searches that gain this, and explain a video with some causes; what they were last asked for of each video."""
    asked: dict[int, list[str]] = {}

    def searched(
        _self: object, video: int, candidates: list[tuple[Effect, ...]]
    ) -> list[tuple[tuple[Effect, ...], single_videos._Found]]:
        named = [(causes, tuple(cause.name for cause in causes)) for causes in candidates]
        asked[video] = ["+".join(names) for _, names in named]
        return [(causes, single_videos._Found(GAINS.get(names, 0.0), names in explains)) for causes, names in named]

    monkeypatch.setattr(single_videos._Searches, "with_causes", searched)
    return asked


@pytest.mark.parametrize(
    ("explains", "told"),
    [
        ([("contact_friction", "slip_to_roll")], [("contact_friction", "slip_to_roll")]),
        ([("pair_force",), ("contact_friction", "slip_to_roll")], [("pair_force",)]),
        ([], [("pair_force",)]),
    ],
    ids=["two together", "one", "none"],
)
@pytest.mark.parametrize("lost", [[2], [2, 0, 1]])
def test_two_causes_at_contacts_are_told_where_none_explains_a_video_alone(
    lost: list[int], explains: list[tuple[str, ...]], told: list[tuple[str, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    _with_gains(explains, monkeypatch)
    effects = [ContactFriction(), SlipToRoll(), PairForce(), SurfaceTilt()]
    found = causes_of_lost_videos(
        create_autospec(SharedFit, instance=True), lost, effects, {"surface_tilt"}, 6.0, seed=0
    )
    assert [tuple(cause.name for cause in causes) for causes, _ in found] == told
    if len(told[0]) > 1:
        assert found[0][1] == 200.0 * min(len(lost), single_videos.WITH_ALL)


@pytest.mark.parametrize(
    ("explained", "told"), [(0, ["contact_friction", "slip_to_roll"]), (1, ["pair_force"])], ids=["second", "third"]
)
def test_two_causes_may_explain_the_second_worst_video_alone(
    explained: int, told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The worst one may be too hard to search even with both."""

    def searched(
        _self: object, video: int, candidates: list[tuple[Effect, ...]]
    ) -> list[tuple[tuple[Effect, ...], single_videos._Found]]:
        gained = [GAINS.get(tuple(cause.name for cause in causes), 0.0) for causes in candidates]
        explains = [
            video == explained and len(causes) == 2 and gains > 0
            for causes, gains in zip(candidates, gained, strict=True)
        ]
        return [(causes, single_videos._Found(*one)) for causes, *one in zip(candidates, gained, explains, strict=True)]

    monkeypatch.setattr(single_videos._Searches, "with_causes", searched)
    effects = [ContactFriction(), SlipToRoll(), PairForce()]
    found = causes_of_lost_videos(create_autospec(SharedFit, instance=True), [2, 0, 1], effects, set(), 6.0, seed=0)
    (causes, gained), *_ = found
    assert [cause.name for cause in causes] == told
    assert gained == (400.0 if len(told) == 2 else 90.0)


@pytest.mark.parametrize(
    ("explains", "told"),
    [([("slip_to_roll",)], ["slip_to_roll"]), ([], ["pair_force"])],
    ids=["one explains videos", "none does"],
)
def test_what_gains_most_and_explains_no_video_is_not_told_beside_what_explains_some(
    explains: list[tuple[str, ...]], told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _with_gains(explains, monkeypatch)
    effects = [SlipToRoll(), PairForce()]
    found = causes_of_lost_videos(create_autospec(SharedFit, instance=True), [2, 0, 1], effects, set(), 6.0, seed=0)
    assert [cause.name for (cause,), _ in found] == told


def test_what_explains_more_videos_is_told_before_what_gains_more(monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(
        _self: object, video: int, candidates: list[tuple[Effect, ...]]
    ) -> list[tuple[tuple[Effect, ...], single_videos._Found]]:
        gained = {SlipToRoll.name: (20.0, True), PairForce.name: (30.0, video == 2)}
        return [(causes, single_videos._Found(*gained[causes[0].name])) for causes in candidates]

    monkeypatch.setattr(single_videos._Searches, "with_causes", searched)
    fit = create_autospec(SharedFit, instance=True)
    found = causes_of_lost_videos(fit, [2, 0, 1], [PairForce(), SlipToRoll()], set(), 6.0, seed=0)
    assert [(cause.name, gained) for (cause,), gained in found] == [("slip_to_roll", 60.0), ("pair_force", 90.0)]


@pytest.mark.parametrize(("explains", "told"), [([], []), ([("pair_force",)], ["pair_force"])], ids=["none", "one"])
def test_the_last_causes_are_told_only_where_one_explains_a_video(
    explains: list[tuple[str, ...]], told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And none that has brought too little in one video is tried in the next, nor two at once."""
    tried = _with_gains(explains, monkeypatch)
    effects = [ContactFriction(), SlipToRoll(), PairForce(), SurfaceTilt()]
    found = causes_of_lost_videos(
        create_autospec(SharedFit, instance=True), [2, 0], effects, {"surface_tilt"}, 6.0, seed=0, must_explain=True
    )
    assert [cause.name for (cause,), _ in found] == told
    assert sorted(tried[2]) == ["contact_friction", "pair_force", "slip_to_roll", "surface_tilt"]
    assert "contact_friction" not in tried[0]


@pytest.mark.slow
def test_friction_of_contacts_is_told_by_the_videos_that_nothing_else_explains() -> None:
    _, fit = fitted("contact_friction", 3.0, seed=1)
    ratios = [part.misfit.ratio for part in fit.fits]
    worst = ratios.index(max(ratios))
    assert ratios[worst] > 1.2
    effects = [SurfaceTilt(), ContactFriction(), ClockError(), MaterialFriction()]
    found = causes_of_lost_videos(fit, [worst], effects, {effect.name for effect in effects}, 6.0, seed=0)
    assert found[0][0][0].name == "contact_friction"
    assert found[0][1] > 50


@pytest.mark.slow
def test_nothing_is_searched_with_what_is_neither_likely_nor_acts_in_contacts() -> None:
    _, fit = fitted("contact_friction", 3.0, seed=1)
    assert causes_of_lost_videos(fit, [0, 1], [SurfaceTilt(), ClockError()], set(), 6.0, seed=0) == []
