"""Videos of two discs, computed by hand, with questions whose answers are known."""

import json
from pathlib import Path

import numpy as np

SPEEDS = (1.2, 1.5, 0.9)
FRAMES = 50
RATE = 25.0
ROW = "{video},{body},{time:.2f},{x:.5f},{y:.5f}"


def write_videos(folder: Path) -> Path:
    """Write a tracks folder of three videos and its question file; returns the question file.

    A red disc runs into a resting blue one: no friction, equal masses, restitution 0.8 for the pair.
    """
    folder.mkdir(parents=True, exist_ok=True)
    noise = np.random.default_rng(0)
    rows, objects, scenes = ["video,object,time,x,y"], ["video,object,shape,radius,material,color"], []
    for number, speed in enumerate(SPEEDS):
        video, contact = f"video_{number:05d}", 0.7 / speed
        for frame in range(FRAMES):
            time = frame / RATE
            after = max(time - contact, 0)
            places = {"1": -1.1 + speed * (min(time, contact) + 0.1 * after), "2": 0.9 * speed * after}
            for body, x in places.items():
                wobble = noise.normal(0, 0.003, 2)
                rows.append(ROW.format(video=video, body=body, time=time, x=x + wobble[0], y=wobble[1]))
        objects += [f"{video},1,cylinder,0.2,metal,red", f"{video},2,cylinder,0.2,rubber,blue"]
        scenes.append({"scene_index": 10 + number, "video_filename": f"{video}.mp4", "questions": questions()})
    (folder / "tracks.csv").write_text("\n".join(rows) + "\n")
    (folder / "objects.csv").write_text("\n".join(objects) + "\n")
    file = folder / "questions.json"
    file.write_text(json.dumps(scenes))
    return file


def questions() -> list[dict[str, object]]:
    """Questions of every kind; the last answer is wrong on purpose."""
    collide = {"choice_id": 0, "choice": "The red cylinder and the blue cylinder collide"}
    return [
        {"question_id": 0, "question": "How many collisions happen?", "answer": "1"},
        {
            "question_id": 1,
            "question": "What is responsible for the collision between the red cylinder and the blue cylinder?",
            "choices": [{"choice_id": 0, "choice": "the presence of the red cylinder", "answer": "wrong"}],
        },
        {"question_id": 2, "question": "What will happen next?", "choices": [{**collide, "answer": "wrong"}]},
        {
            "question_id": 3,
            "question": "If the blue cylinder were heavier, what would happen?",
            "choices": [{**collide, "answer": "correct"}],
        },
        {"question_id": 4, "question": "What is the shape of the red object?", "answer": "cube"},
    ]
