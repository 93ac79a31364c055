"""The player's data: small, exact to a step, strict JSON."""

import base64
import json
import zlib

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.report.payload import encode, player_data


def decode(text, frames):
    """The browser's part: sums of second differences, modulo 2^16."""
    differences = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i2").reshape(-1, frames)
    with np.errstate(over="ignore"):
        return np.cumsum(np.cumsum(differences, axis=-1, dtype=np.int16), axis=-1, dtype=np.int16)


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 1e4))
def test_decoding_gives_the_trajectories_back(seed, reach):
    random = np.random.default_rng(seed)
    trajectory = random.uniform(-reach, reach, (3, 7, 2, 3))
    step = reach / 16000
    text, whole = encode(trajectory, step)
    decoded = decode(text, 7).reshape(2, 3, 3, 7)
    assert np.array_equal(decoded, whole)
    positions = decoded[:, :2].transpose(2, 3, 0, 1) * step
    assert np.abs(positions - trajectory[..., :2]).max() <= 0.5001 * step
    turns = (decoded[:, 2].transpose(1, 2, 0) / 65536 - trajectory[..., 2] / (2 * np.pi) + 0.5) % 1 - 0.5
    assert np.abs(turns).max() < 1e-5


def test_runaways_are_held_at_the_edge():
    _, whole = encode(np.full((1, 2, 1, 3), 1e9), 1e-3)
    assert (whole[0, :2] == 32767).all()


def test_data_are_strict_json_and_small(content):
    text = json.dumps(player_data(content), allow_nan=False)
    assert len(text) < 1e6


def test_worlds_say_when_bodies_appear(content):
    worlds = {world["key"]: world for world in player_data(content)["worlds"]}
    assert len(worlds) == 17
    first = np.array(worlds["factual"]["first"])
    assert first.shape == (content.worlds[0].draws, 5)
    assert (first[:, [1, 2]] == 0).all()
    assert (first[:, 0] == 75).all()
    removed = worlds["removed:1"]
    assert (np.array(removed["first"])[:, 1] == len(removed["times"])).all()
    assert removed["label"] == "Without the purple cube"


def test_shares_carry_the_error_of_their_draws(content):
    shares = [pair["share"] for world in player_data(content)["worlds"] for pair in world["pairs"]]
    assert "> 93 %" in shares  # all of 30 draws
    assert "> 99 %" not in shares
    assert any("±" in share for share in shares)


def test_collisions_are_in_order_of_time(content):
    for world in player_data(content)["worlds"]:
        times = world["collisions"]["time"]
        assert times == sorted(times)
