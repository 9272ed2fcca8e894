"""Random descriptions of persons: body, clothes, colors. One split of clothes, hair and fabrics stays unseen in training."""

import numpy as np

CLOTHES = {
    ("male", "train"): [
        "male_casualsuit01",
        "male_casualsuit02",
        "male_casualsuit03",
        "male_casualsuit05",
        "male_casualsuit06",
        "male_elegantsuit01",
    ],
    ("male", "unseen"): ["male_casualsuit04", "male_worksuit01"],
    ("female", "train"): [
        "female_casualsuit01",
        "female_elegantsuit01",
        "female_sportsuit01",
        "male_casualsuit02",
        "male_casualsuit06",
    ],
    ("female", "unseen"): ["female_casualsuit02", "male_casualsuit04"],
}
HAIR = {
    ("male", "train"): ["short01", "short02", "short04"],
    ("male", "unseen"): ["short03"],
    ("female", "train"): ["bob01", "bob02", "long01", "braid01", "short02"],
    ("female", "unseen"): ["ponytail01", "short03"],
}
SHOES = {"train": ["shoes01", "shoes02", "shoes04", "shoes06"], "unseen": ["shoes03", "shoes05"]}
FABRICS = {"train": range(0, 24), "unseen": range(24, 32)}
"""Numbers of the procedural fabrics that textures.py makes."""
SKIN = {"caucasian": (0.66, 0.45, 0.35), "asian": (0.60, 0.41, 0.29), "african": (0.16, 0.085, 0.055)}
HAIR_TINTS = (
    (0.22, 0.2, 0.19),
    (0.3, 0.26, 0.22),
    (0.5, 0.42, 0.36),
    (1, 1, 1),
    (0.75, 0.65, 0.55),
    (1.5, 1.35, 1.0),
    (1.9, 1.9, 1.95),
)
EXTRAS = (
    "backpack",
    "shoulder_bag",
    "cap",
    "hood",
    "helmet",
    "long_coat",
    "skirt",
    "box",
    "suitcase",
    "scarf",
    "vest",
)


def random_ages(rng, child):
    """Shares of MakeHuman's ages, and a stature in meters."""
    if child:
        share = float(rng.uniform(0, 1))  # 0: about four years, 1: about fourteen.
        ages = (
            {"baby": 0.45 * (1 - share), "child": 1 - 0.45 * (1 - share)}
            if share < 0.7
            else {"child": 0.6, "young": 0.4}
        )
        return ages, float(0.98 + 0.55 * share + rng.normal() * 0.04)
    old = float(rng.choice([0, 0, 0, 0.3, 0.7, 1.0]))
    return ({"young": 1 - old, "old": old} if old else {"young": 1.0}), None


def random_person(rng, assets, split="train", child=False):
    """A description that `Body.build` and `blender_person` read. Deterministic given the generator's state."""
    sex = str(rng.choice(["male", "female"]))
    ages, stature = random_ages(rng, child)
    ancestry = str(rng.choice(["caucasian", "caucasian", "asian", "asian", "african"]))
    suit = str(rng.choice(CLOTHES[sex, split]))
    hair = str(rng.choice(HAIR[sex, split]))
    if split == "train" and ancestry == "african" and rng.random() < 0.4:
        hair = "afro01"
    shoes = str(rng.choice(SHOES[split]))
    wear = [
        (f"{assets}/clothes/{suit}/{suit}.mhclo", "cloth"),
        (f"{assets}/clothes/{shoes}/{shoes}.mhclo", "shoe"),
    ]
    if not (sex == "male" and rng.random() < 0.12):
        wear.append((f"{assets}/hair/{hair}/{hair}.mhclo", "hair"))
    wear.append((f"{assets}/eyebrows/eyebrow001/eyebrow001.mhclo", "hair"))
    extras = [
        e
        for e in EXTRAS
        if rng.random()
        < {
            "backpack": 0.12,
            "shoulder_bag": 0.12,
            "cap": 0.07,
            "hood": 0.05,
            "helmet": 0.02,
            "long_coat": 0.10,
            "skirt": 0.25 if sex == "female" else 0.0,
            "box": 0.05,
            "suitcase": 0.04,
            "scarf": 0.06,
            "vest": 0.04,
        }[e]
    ]
    return dict(
        sex=sex,
        ancestry=ancestry,
        ages=ages,
        child=child,
        muscle=float(rng.uniform(-0.6, 0.7)),
        weight=float(rng.uniform(-0.7, 0.95)),
        ideal=float(rng.uniform(0, 0.8)),
        stature=stature or float(np.clip(rng.normal(1.76 if sex == "male" else 1.64, 0.075), 1.45, 2.0)),
        wear=wear,
        suit=suit,
        extras=extras,
    )


def random_colours(rng, who, split="train"):
    """Colors and fabrics; drawn anew for every view of a body, which multiplies the outfits."""
    skin = np.array(SKIN[who["ancestry"]]) * rng.uniform(0.75, 1.2)
    garment = lambda: dict(
        fabric=int(rng.choice(list(FABRICS[split]))) if rng.random() < 0.6 else None,
        hue=float(rng.uniform(0, 1)),
        saturation=float(rng.choice([0.1, 0.3, 0.6, 1.0], p=[0.4, 0.3, 0.2, 0.1]) * rng.uniform(0.6, 1.2)),
        value=float(np.exp(rng.uniform(-2.2, 0.3))),
    )
    top, bottom = garment(), garment()
    bottom["value"] = float(min(bottom["value"], np.exp(rng.uniform(-1.5, 0.3))))
    if rng.random() < 0.15:
        bottom = dict(top)
    return dict(
        skin=[float(x) for x in skin],
        hair=[float(x) for x in HAIR_TINTS[rng.integers(len(HAIR_TINTS))]],
        top=top,
        bottom=bottom,
        extra=[
            [float(x) for x in np.exp(rng.uniform(-4, -0.7)) * (1 + rng.uniform(0.1, 0.8) * rng.uniform(-1, 1, 3))]
            for _ in EXTRAS
        ],
        extra_fabric=int(rng.choice(list(FABRICS[split]))) if rng.random() < 0.4 else None,
    )
