"""Procedural textures (ours, numpy only): floors, walls, wood, rugs, fabrics, posters and screens without persons."""

import cv2
import numpy as np

SIZE = 1024


def noise(n, scale, rng, octaves=4):
    out = np.zeros((n, n), np.float32)
    for octave in range(octaves):
        k = min(max(2, int(scale * 2**octave)), n)
        out += cv2.resize(rng.normal(size=(k, k)).astype(np.float32), (n, n), interpolation=cv2.INTER_CUBIC) / 2**octave
    return out / out.std()


def grain(n, rng):
    long = cv2.resize(rng.normal(size=(160, 4)).astype(np.float32), (n, n), interpolation=cv2.INTER_CUBIC)
    fine = cv2.resize(rng.normal(size=(n, 16)).astype(np.float32), (n, n), interpolation=cv2.INTER_CUBIC)
    out = long + 0.6 * fine
    return out / out.std()


def planks(rng, colour, rows):
    image, height, texture = np.zeros((SIZE, SIZE, 3), np.float32), SIZE // rows, grain(SIZE, rng)
    for i in range(rows):
        cuts = sorted([0, SIZE] + [int(x) for x in rng.uniform(0, SIZE, 3)])
        for a, b in zip(cuts[:-1], cuts[1:]):
            if b > a:
                piece = np.roll(texture, rng.integers(SIZE), 1)[:height, : b - a]
                image[i * height : (i + 1) * height, a:b] = (
                    np.array(colour) * (1 + 0.12 * rng.normal()) * (1 + 0.05 * piece[..., None])
                )
                image[i * height : (i + 1) * height, a : a + 2] *= 0.6
        image[i * height : i * height + 2] *= 0.6
    return image


def tiles(rng, colour, count):
    image = np.ones((SIZE, SIZE, 3), np.float32) * np.array(colour) * (1 + 0.03 * noise(SIZE, 6, rng)[..., None])
    edges = [int(i * SIZE / count) for i in range(count + 1)]
    grout = np.array(colour) * rng.uniform(0.5, 0.9)
    for i in range(count):
        for j in range(count):
            image[edges[i] : edges[i + 1], edges[j] : edges[j + 1]] *= 1 + 0.03 * rng.normal()
    for e in edges[:-1]:
        image[e : e + 6] = grout
        image[:, e : e + 6] = grout
    return image


def checker(rng, one, two, count=8):
    rows = np.arange(SIZE) * count // SIZE
    mask = ((rows[:, None] + rows[None]) % 2)[..., None]
    return (mask * np.array(one) + (1 - mask) * np.array(two)) * (1 + 0.03 * noise(SIZE, 10, rng)[..., None])


def carpet(rng, colour):
    image = np.ones((SIZE, SIZE, 3), np.float32) * np.array(colour) * (1 + 0.16 * rng.normal(size=(SIZE, SIZE, 1)))
    return image * (1 + 0.06 * noise(SIZE, 5, rng)[..., None])


def terrazzo(rng, colour):
    image = np.ascontiguousarray(
        np.ones((SIZE, SIZE, 3), np.float32)
        * np.array(colour, np.float32)
        * (1 + 0.03 * noise(SIZE, 4, rng)[..., None])
    )
    for _ in range(2500):
        x, y = rng.integers(0, SIZE, 2)
        axes = (int(rng.integers(1, 6)), int(rng.integers(1, 4)))
        cv2.ellipse(
            image,
            (int(x), int(y)),
            axes,
            float(rng.uniform(0, 180)),
            0,
            360,
            (np.array(colour) * rng.uniform(0.5, 1.2)).tolist(),
            -1,
        )
    return image


def rug(rng, kind):
    colours = [rng.uniform(0.1, 0.6, 3) for _ in range(4)]
    image = np.ascontiguousarray(np.ones((SIZE, SIZE, 3)) * colours[0])
    if kind == 0:
        for k in range(0, SIZE, 64):
            image[k : k + int(rng.integers(16, 40))] = colours[1 + (k // 64) % 3]
    elif kind == 1:
        for m in (60, 110, 150):
            cv2.rectangle(image, (m, m), (SIZE - m, SIZE - m), colours[(m // 40) % 4].tolist(), 22)
        for k in range(4):
            cv2.circle(image, (SIZE // 2, SIZE // 2), 300 - 60 * k, colours[k].tolist(), -1)
    else:
        for a in range(0, SIZE, 128):
            for b in range(0, SIZE, 128):
                cv2.circle(image, (a + 64, b + 64), 40, colours[(a // 128 + b // 128) % 3 + 1].tolist(), -1)
    return image * (1 + 0.14 * rng.normal(size=(SIZE, SIZE, 1)))


def fabric(rng, number, n=512):
    """Plain, stripes, checks, dots, camouflage, print: mid-gray on average, so that a tint colors it."""
    muted = lambda low, high: (
        rng.uniform(low, high) * (1 + 0.35 * rng.uniform(-1, 1, 3))
    )  # Clothes are grayer than paint.
    base, other = muted(0.25, 0.75), muted(0.05, 0.95)
    image = np.ones((n, n, 3), np.float32) * base
    y, x = np.mgrid[0:n, 0:n]
    period = int(rng.choice([16, 24, 36, 64]))
    kind = number % 8
    if kind == 1:
        image[(y % period) < period * rng.uniform(0.2, 0.6)] = other
    elif kind == 2:
        image[(x % period) < period * rng.uniform(0.1, 0.6)] = other
    elif kind == 3:
        share = ((x % period < period // 2) * 0.5 + (y % period < period // 2) * 0.5)[..., None]
        image = image * (1 - share) + other * share
    elif kind == 4:
        image[((x % period - period / 2) ** 2 + (y % period - period / 2) ** 2) < (period * 0.25) ** 2] = other
    elif kind == 5:
        blots = noise(n, 10, rng)
        image[blots > 0.4] = other
        image[blots < -0.7] = muted(0.05, 0.8)
    elif kind == 6:
        image = np.ascontiguousarray(image)
        for _ in range(60):
            centre = tuple(int(v) for v in rng.integers(0, n, 2))
            cv2.circle(image, centre, int(rng.integers(4, 30)), rng.uniform(0, 1, 3).tolist(), -1)
    elif kind == 7:
        image[: n // 2] = other
    return image * (1 + 0.08 * rng.normal(size=(n, n, 1))) * (1 + 0.05 * noise(n, 8, rng)[..., None])


def abstract_poster(rng):
    image = np.ascontiguousarray(np.ones((512, 512, 3)) * rng.uniform(0.3, 0.95, 3))
    for _ in range(int(rng.integers(4, 14))):
        colour, (x, y, a, b) = rng.uniform(0, 1, 3).tolist(), [int(v) for v in rng.integers(0, 512, 4)]
        if rng.random() < 0.5:
            cv2.rectangle(image, (x, y), (a, b), colour, -1)
        else:
            cv2.circle(image, (x, y), int(rng.integers(20, 140)), colour, -1)
    for k in range(int(rng.integers(0, 8))):
        image[300 + 20 * k : 308 + 20 * k, 60 : 60 + int(rng.integers(100, 400))] = 0.15
    return image


def screen(rng, background):
    image = np.ones((512, 512, 3)) * np.array(background)
    for k in range(30):
        y = 30 + 15 * k
        image[y : y + 6, 60 + 20 * int(rng.integers(0, 4)) : 120 + int(rng.integers(0, 340))] = (
            rng.uniform(0, 1, 3) * 0.8
        )
    return image


def write_all(folder, seed=5):
    """Writes every texture as PNG. The same seed gives the same files."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)

    def save(name, image):
        cv2.imwrite(str(folder / f"{name}.png"), np.clip(image[..., ::-1] * 255, 0, 255).astype(np.uint8))

    grey = lambda low, high: rng.uniform(low, high) * np.array([1, 1, 1]) + rng.uniform(-0.03, 0.03, 3)
    for i, colour in enumerate(
        [
            (0.50, 0.33, 0.20),
            (0.36, 0.22, 0.13),
            (0.66, 0.50, 0.33),
            (0.24, 0.16, 0.11),
            (0.55, 0.45, 0.36),
            (0.45, 0.28, 0.15),
        ]
    ):
        save(f"floor_wood{i}", planks(rng, colour, 8))
        save(f"wood{i}", np.array(colour) * (1 + 0.07 * grain(SIZE, rng)[..., None]))
    for i in range(10):
        save(f"floor_tile{i}", tiles(rng, grey(0.25, 0.75), int(rng.integers(3, 8))))
    for i in range(8):
        save(f"floor_carpet{i}", carpet(rng, np.clip(grey(0.1, 0.45) + rng.uniform(-0.1, 0.1, 3), 0.03, 1)))
    for i in range(5):
        save(f"floor_terrazzo{i}", terrazzo(rng, grey(0.35, 0.7)))
    for i in range(4):
        save(f"floor_concrete{i}", grey(0.3, 0.65) * (1 + 0.06 * noise(SIZE, 3, rng, 6)[..., None]))
    for i in range(4):
        save(f"floor_checker{i}", checker(rng, grey(0.55, 0.75), rng.uniform(0.05, 0.45, 3)))
    for i in range(12):
        save(
            f"wall{i}",
            np.clip(grey(0.4, 0.8) + rng.uniform(-0.02, 0.02, 3), 0, 1)
            * (1 + 0.015 * noise(SIZE, 3, rng, 6)[..., None]),
        )
    for i in range(9):
        save(f"rug{i}", rug(rng, i % 3))
    for i in range(16):
        save(f"poster{i}", abstract_poster(rng))
    for i, background in enumerate([(0.92, 0.93, 0.95), (0.12, 0.14, 0.18), (0.3, 0.45, 0.65), (0.85, 0.6, 0.3)]):
        save(f"screen{i}", screen(rng, background))
    for i in range(32):
        save(f"fabric{i}", fabric(rng, i))
