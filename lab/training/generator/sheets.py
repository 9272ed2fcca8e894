"""Contact sheets: montages of crops, rooms and frames, to be looked at before anything is trained on them."""

import json

import cv2
import numpy as np

from .tone import display


def montage(tiles, columns, side):
    """Tiles scaled into squares of `side` pixels, row by row."""
    cells = []
    for tile in tiles:
        scale = side / max(tile.shape[:2])
        small = cv2.resize(
            tile, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
        )
        cell = np.zeros((side, side, 3), np.uint8)
        cell[: small.shape[0], : small.shape[1]] = small[:side, :side]
        cells.append(cell)
    while len(cells) % columns:
        cells.append(np.zeros((side, side, 3), np.uint8))
    return np.vstack([np.hstack(cells[i : i + columns]) for i in range(0, len(cells), columns)])


def person_sheet(folder, limit=16, views=6):
    from .crops import CropFile

    tiles = []
    for path in sorted(folder.glob("*.npz"))[-limit:]:
        if "partial" in path.name:
            continue
        file = CropFile(path)
        for k in range(min(views, len(file.views))):
            crop = file.crop(k)
            grey = np.full(crop.colour.shape, 0.18, np.float32)
            image = display(crop.colour + grey * (1 - crop.alpha[..., None]), 1.0)
            edge = np.zeros(crop.index.shape, np.uint8)
            for i in np.unique(crop.index[crop.index > 0]):
                mask = ((crop.index == i) & (crop.alpha > 0.5)).astype(np.uint8)
                edge |= cv2.dilate(mask, np.ones((3, 3), np.uint8)) - mask
            image[edge > 0] = (0, 200, 0)
            tiles.append(np.ascontiguousarray(image[..., ::-1]))
    return montage(tiles, views * 2, 150) if tiles else None


def room_sheet(folder, limit=24):
    tiles = []
    for path in sorted(folder.glob("*.npz"))[-limit:]:
        if "partial" in path.name:
            continue
        from .crops import RoomFile

        room = RoomFile(path)
        tiles.append(np.ascontiguousarray(display(room.colour, room.about["exposure"])[..., ::-1]))
    return montage(tiles, 4, 440) if tiles else None


def frame_sheet(folder, limit=12):
    tiles, path = [], folder / "annotations.json"
    if not path.exists():
        return None
    data = json.loads(path.read_text())
    for image in data["images"][-limit:]:
        tile = cv2.imread(str(folder / "images" / image["file_name"]))
        for a in (a for a in data["annotations"] if a["image_id"] == image["id"]):
            x, y, w, h = (int(round(v)) for v in a["bbox"])
            colour = (160, 160, 160) if a["ignore"] else (0, 220, 0)
            cv2.rectangle(tile, (x, y), (x + w, y + h), colour, 1)
            corners = cv2.boxPoints(((a["obb"][0], a["obb"][1]), (a["obb"][2], a["obb"][3]), a["obb"][4]))
            cv2.polylines(
                tile,
                [np.rint(corners).astype(np.int32)],
                True,
                (0, 180, 255) if not a["ignore"] else (110, 110, 110),
                1,
            )
        tiles.append(tile)
    return montage(tiles, 3, 620)


def make_sheets(work, split):
    out = work / "sheets"
    out.mkdir(parents=True, exist_ok=True)
    for name, sheet in (
        ("persons", person_sheet(work / "persons" / split)),
        ("rooms", room_sheet(work / "rooms" / split)),
        ("frames", frame_sheet(work / "frames" / split)),
    ):
        if sheet is not None:
            cv2.imwrite(str(out / f"{name}-{split}.png"), sheet)
            print(out / f"{name}-{split}.png")
