"""Video to tracks."""

from vrdp_prob.perception.reading import read_video
from vrdp_prob.perception.video import still

__all__ = ["read_video", "still"]
