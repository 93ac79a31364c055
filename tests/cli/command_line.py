"""Tracks made by hand, and a command that must refuse its input."""

import numpy as np
import pytest

from vrdp_prob import cli

TRACKS_HEADER = "video,object,time,x,y"
OBJECTS = "video,object,shape,radius,material,color\nv,1,sphere,0.2,metal,red\nv,2,cylinder,0.2,rubber,blue\n"


def two_discs(frames: int = 60) -> str:
    """Tracks of a red sphere that runs into a resting blue cylinder, computed by hand: no friction, e = 0.8."""
    noise = np.random.default_rng(0)
    rows = [TRACKS_HEADER]
    for frame in range(frames):
        time = frame / 25
        contact = 1.1 / 1.5
        first = -1.5 + 1.5 * min(time, contact) + 0.15 * max(time - contact, 0)
        second = 0.0 + 1.35 * max(time - contact, 0)
        for name, x in (("1", first), ("2", second)):
            rows.append(f"v,{name},{time:.2f},{x + noise.normal(0, 0.003):.5f},{noise.normal(0, 0.003):.5f}")
    return "\n".join(rows) + "\n"


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run a command that must refuse its input with exit code 2 and one line; return the line."""
    assert cli.run([str(argument) for argument in arguments]) == cli.UNUSABLE_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.strip().splitlines()
    assert line.startswith("vrdp-prob: ")
    assert line.endswith((".", ")"))
    return line
