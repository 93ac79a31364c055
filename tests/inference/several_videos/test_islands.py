"""Videos are joined anew, with cubes turned and without what these say of spins, only where that may be what lacks."""

from unittest.mock import Mock

import pytest

from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.search.plan import FitPlan
from vrdp_prob.inference.several_videos import joining
from vrdp_prob.inference.several_videos.joint_fit import JointFit
from vrdp_prob.models.physics import PhysicsModel

FIRST, TURNED, APART = "as they are", "cubes turned", "without what cubes say of spins"


@pytest.mark.parametrize(
    ("explained", "cubes", "strays", "joins"),
    [
        (True, True, [FIRST, TURNED], [FIRST, TURNED, APART]),
        (True, True, [FIRST], [FIRST, TURNED]),
        (True, True, [], [FIRST]),
        (True, False, [FIRST, TURNED], [FIRST]),
        (False, True, [FIRST, TURNED], [FIRST]),
    ],
    ids=["all is tried", "turning is enough", "none strays", "no cubes", "no video is explained"],
)
def test_islands_are_crossed_where_videos_are_explained_and_stray_together(
    explained: bool, cubes: bool, strays: list[str], joins: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone, turned = [Mock(spec=MapFit)], [Mock(spec=MapFit)]
    made: list[str] = []
    joints = {name: Mock(spec=JointFit, log_density=float(k)) for k, name in enumerate((FIRST, TURNED, APART))}

    def joined(fits: list[MapFit], *, islands: bool, **_how: object) -> tuple[list[MapFit], JointFit]:
        made.append(APART if islands else TURNED if fits is turned else FIRST)
        return fits, joints[made[-1]]

    monkeypatch.setattr(joining, "_joined", joined)
    monkeypatch.setattr(joining, "_turned", lambda *_fits, **_how: turned)
    monkeypatch.setattr(joining, "_has_unseen_yaws", lambda _fit: cubes)
    monkeypatch.setattr(joining, "explained", lambda _fits: explained)
    monkeypatch.setattr(joining, "_strays", lambda _fits, joint: any(joint is joints[name] for name in strays))
    _, joint = joining.joined(alone, PhysicsModel.base(), None, seed=0, plan=FitPlan())
    assert made == joins
    assert joint is joints[joins[-1]]
