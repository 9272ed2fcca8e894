"""Composes many frames of each of some tilted cameras, with other people in each: a data set for `lab/calibration/floor_places.py`.

    python lab/training/make.py persons --work WORK --split unseen --first-seed 2100000 --count 70
    python lab/training/fixed_cameras.py --work WORK --split unseen --cameras 12 --people 200 --out OUT [--upright]

Each camera has one room, lens, tilt of 3 to 20 degrees, and look of its own. It has 20 to 60 frames: until `--people`
visible persons are in them. They are 1.50 to 1.95 m tall. With `--upright`, all of them stand or walk. Each image has its
`people`: feet in pixels, stature, pose, angle from straight down, and the name of the person.
"""

import argparse
import json
import math
from pathlib import Path

import cv2
import numpy as np
from generator.compose import compose
from generator.crops import CropFile, RoomFile
from generator.frames import annotate
from generator.geometry import Calibration, camera_rotation, make_lens, radius_of
from generator.heights import HEIGHTS
from generator.look import apply_look, random_look
from generator.placement import place
from generator.progress import Progress

STATURES = (1.50, 1.95)
"""Meters, after the scaling of crops to the height of the camera."""
TILTS = (3.0, 20.0)
"""Degrees."""
CAMERA_HEIGHTS = (float(HEIGHTS[0]), 4.2)
"""Meters: rooms with other heights are left out."""
STRIDE = 5
"""Between the tilts of one room and the next, in steps of the tilts: has no common factor with the number of cameras."""
SIDES = (720, 832, 960)
LEAST_SIDE = 5.0
"""Meters: rooms that are narrower hold too few persons."""
WANTED = 10
FRAMES = (20, 60)
"""The least and the most of each camera."""
UPRIGHT = ("standing", "walking", "reaching")


def is_suitable(room):
    """Whether a room is high and wide enough."""
    low, high = CAMERA_HEIGHTS
    return low <= room["camera_height"] <= high and min(room["size"]) >= LEAST_SIDE


def make_camera(rng, room, tilt):
    """A camera with a random lens, center and turn. Its circle ends where the panorama of the room does."""
    side = int(rng.choice(SIDES))
    lens = make_lens(rng, side / 2)
    lens["max_theta"] = min(lens["max_theta"], room["max_theta"] - tilt)
    lens["focal"] *= 0.49 * side / float(radius_of(lens, lens["max_theta"]))
    rotation = camera_rotation(float(rng.uniform(0, 2 * math.pi)), tilt, float(rng.uniform(0, 2 * math.pi)))
    cx, cy = ((side - 1) / 2 + float(rng.normal() * 0.004 * side) for _ in range(2))
    return Calibration(side, side, lens, cx, cy, rotation, room["camera_height"])


def is_wanted(placement):
    """Whether all persons of a placement have one of the wanted statures."""
    statures = [person["stature"] * placement.scale for person in placement.file.about["persons"]]
    return all(STATURES[0] <= stature <= STATURES[1] for stature in statures)


def people_of(composition, calibration):
    """The visible persons whose feet the lens sees."""
    by_number = {person["number"]: person for person in composition.persons}
    people = []
    for annotation in annotate(composition, calibration):
        person = by_number[annotation["id_value"]]
        feet = np.array([[*annotation["floor_xy"], 0.0]])
        pixels, theta = calibration.project(feet)
        if annotation["ignore"] or theta[0] > calibration.lens["max_theta"]:
            continue
        people.append(
            dict(
                feet_px=pixels[0].round(2).tolist(),
                stature_m=round(person["about"]["stature"] * person["placement"].scale, 3),
                pose=annotation["pose"],
                nadir_deg=annotation["nadir_deg"],
                person=f"{annotation['source']}-{person['about']['index']}",
            )
        )
    return people


def make_frames_of(room, files, number, options):
    """Writes the frames and the calibration of one camera, and returns the entries of its images."""
    rng = np.random.default_rng([options.seed, room.about["seed"]])
    share = number * STRIDE % options.cameras / max(1, options.cameras - 1)
    tilt = math.radians(TILTS[0] + (TILTS[1] - TILTS[0]) * share)
    calibration, look = make_camera(rng, room.about, tilt), random_look(rng)
    name, images = str(room.about["seed"]), []
    native = json.dumps(calibration.native(name), indent=1)
    (options.out / "calibrations" / f"{name}.json").write_text(native)
    prefer = {"infrared": "infrared"}.get(look["kind"], "sun" if look["sun"] else None)
    for shot in range(FRAMES[1]):
        if shot >= FRAMES[0] and sum(len(image["people"]) for image in images) >= options.people:
            break
        placements = [p for p in place(rng, room.about, files, WANTED, prefer) if is_wanted(p)]
        composition = compose(calibration, room, placements, rng, look["sun"])
        file = f"{name}_{shot:03}.jpg"
        quality = [cv2.IMWRITE_JPEG_QUALITY, look["quality"]]
        cv2.imwrite(str(options.out / "images" / file), apply_look(rng, look, composition, calibration), quality)
        size = dict(width=calibration.width, height=calibration.height)
        images.append(
            dict(file_name=file, calibration=name, look=look, people=people_of(composition, calibration), **size)
        )
    return images


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--split", default="unseen")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cameras", type=int, default=12)
    parser.add_argument("--people", type=int, default=200, help="visible persons in the frames of each camera")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--upright", action="store_true", help="leave out persons who sit, bend or crouch")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    for part in ("images", "calibrations"):
        (options.out / part).mkdir(parents=True, exist_ok=True)
    listed = lambda kind: [
        p for p in sorted((options.work / kind / options.split).glob("*.npz")) if "partial" not in p.name
    ]
    files = [CropFile(path) for path in listed("persons")]
    if options.upright:
        files = [file for file in files if all(person["kind"] in UPRIGHT for person in file.about["persons"])]
    # A room takes 15 MB: only those that are composed stay in memory.
    rooms = [path for path in listed("rooms") if is_suitable(RoomFile(path).about)][: options.cameras]
    progress = Progress("cameras", len(rooms))
    images = []
    for number, path in enumerate(rooms):
        images += make_frames_of(RoomFile(path), files, number, options)
        content = dict(images=[dict(image, id=k + 1) for k, image in enumerate(images)], annotations=[])
        (options.out / "annotations.json").write_text(json.dumps(content))
        progress.step()


if __name__ == "__main__":
    main()
