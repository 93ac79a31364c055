"""Video to tracks."""

from vrdp_prob.perception.calibration import calibrate_from_videos
from vrdp_prob.perception.camera_fit import PictureSize, calibrate_camera
from vrdp_prob.perception.crops import Crops
from vrdp_prob.perception.reading import SeenObjects, read_video, see_video
from vrdp_prob.perception.video import still

__all__ = [
    "Crops",
    "PictureSize",
    "SeenObjects",
    "calibrate_camera",
    "calibrate_from_videos",
    "read_video",
    "see_video",
    "still",
]
