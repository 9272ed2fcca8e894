"""The generator's commands: textures, persons, rooms, frames, panoramas, walks. Everything is made below --work and can be resumed.

nice -n 19 python lab/training/make.py persons --work WORK --first-seed 1000000 --count 200
"""

import argparse
import os
from pathlib import Path

FIRST_SEED = 1_000_000
"""Seeds below this one belong to evaluation sets."""


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    items = ("textures", "portraits", "persons", "rooms", "frames", "empty", "panoramas", "walks")
    parser.add_argument("what", choices=items)
    parser.add_argument("--work", type=Path, default=Path(__file__).parent / "work")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--split", choices=("train", "unseen"), default="train")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--nice", type=int, default=19, help="priority; 19 is the lowest")
    parser.add_argument("--samples", type=int, help="samples a pixel")
    parser.add_argument("--angled", action="store_true", help="rooms with slanted walls and the plan of an L")
    parser.add_argument("--resolution", type=int, help="pixels: diameter of a room's panorama to 90 degrees")
    options = parser.parse_args()
    if options.first_seed < FIRST_SEED:
        parser.error(f"--first-seed {options.first_seed} belongs to evaluation sets; use {FIRST_SEED} or more")
    return options


def main():
    options = parse()
    os.nice(max(0, options.nice - os.nice(0)))
    work = options.work.resolve()
    more = {k: v for k, v in (("samples", options.samples), ("resolution", options.resolution)) if v is not None}
    if options.what == "textures":
        from generator.textures import write_all

        write_all(work / "textures")
    elif options.what == "portraits":
        from generator.portraits import render_portraits

        render_portraits(work, options.first_seed, options.count, options.threads)
    elif options.what == "persons":
        from generator.persons import render_persons

        render_persons(work, options.first_seed, options.count, options.split, options.threads, **more)
    elif options.what == "rooms":
        from generator.rooms import render_rooms

        render_rooms(
            work, options.first_seed, options.count, options.split, options.threads, **more, angled=options.angled
        )
    elif options.what in ("frames", "empty"):
        import cv2

        cv2.setNumThreads(options.threads)
        from generator.frames import make_frames

        make_frames(work, options.first_seed, options.count, options.split, is_empty=options.what == "empty")
    elif options.what == "walks":
        import cv2

        cv2.setNumThreads(options.threads)
        from generator.walks import make_walks

        make_walks(work)
    else:
        from generator.panoramas import write_panoramas

        write_panoramas(work, options.split)


if __name__ == "__main__":
    main()
