"""Files that hold scenes and questions: tracks folders, CLEVRER annotations and question files."""

from vrdp_prob.datasets.clevrer import check_scenes, questions_about, read_annotation, read_questions, scene_indices
from vrdp_prob.datasets.folder import read_folder, write_folder
from vrdp_prob.datasets.loading import find_camera, has_tracks, load, load_all, pictures, video_files, video_names

__all__ = [
    "check_scenes",
    "find_camera",
    "has_tracks",
    "load",
    "load_all",
    "pictures",
    "questions_about",
    "read_annotation",
    "read_folder",
    "read_questions",
    "scene_indices",
    "video_files",
    "video_names",
    "write_folder",
]
