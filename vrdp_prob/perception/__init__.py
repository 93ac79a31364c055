"""Video to tracks."""

from vrdp_prob.perception.calibration import calibrate_from_videos
from vrdp_prob.perception.camera_fit import PictureSize, calibrate_camera
from vrdp_prob.perception.reading import read_video
from vrdp_prob.perception.video import still

__all__ = ["PictureSize", "calibrate_camera", "calibrate_from_videos", "read_video", "still"]
