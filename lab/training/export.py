"""Writes the files of a network that Lookdown ships, from the results of trainings.

    python lab/training/export.py --base WORK/nanodet.onnx --tuned WORK/runs/first/averaged.onnx --name nanodet_g_views_416

`--tuned FILE --share 0.5` takes that part of the change by a training: less is learned, and less of the source is
forgotten. Both may be given several times; the changes are added. A tuned file is an ONNX file that `train.py` wrote,
or models/NAME_fp16/model.onnx.

The weights are rounded to half precision. models/NAME_fp16/model.onnx stores them so; models/NAME/model.onnx is INT8,
with activation ranges measured on views of the samples. The sums go into the manifests. The same files give the same
bytes.
"""

import argparse
import re
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "packaging" / "scripts"))

from networks.graph import OnnxGraph  # noqa: E402
from networks.half import HALF, store_halves  # noqa: E402
from networks.quantize import quantize, sha256_of  # noqa: E402

NOTE = "Weights trained on rendered fisheye frames."


def weights_of(file):
    """The weights of an ONNX file by name."""
    return {name.removesuffix(HALF): value for name, value in OnnxGraph(file).constants.items()}


def changed_weights(base, tuned):
    """The weights that a training changed, in half precision."""
    if set(tuned) - set(base):
        raise SystemExit("The files have different weights; the tuned model must be exported from the base model.")
    changed = {name: value for name, value in tuned.items() if not np.array_equal(value, base[name])}
    return halves_of(changed)


def halves_of(weights):
    """The weights in half precision."""
    packed = {name: value.astype(np.float16) for name, value in weights.items()}
    if not all(np.isfinite(value).all() for value in packed.values()):
        raise SystemExit("A weight is too large for half precision.")
    return packed


def mixed(base, changes):
    """The base with the sum of shares of changes, in half precision: `changes` are pairs of changed weights and a share."""
    if len(changes) == 1 and changes[0][1] == 1:
        return changes[0][0]
    total = {}
    for changed, share in changes:
        for name, value in changed.items():
            total[name] = total.get(name, 0) + share * (value.astype(np.float32) - base[name])
    return halves_of({name: base[name] + change for name, change in total.items()})


def write_networks(base_file, weights, models, name, samples):
    """Writes the two ONNX files and their sums."""
    graph = OnnxGraph(base_file)
    for weight, halves in weights.items():
        graph.constants[weight] = halves.astype(graph.constants[weight].dtype)
    with tempfile.TemporaryDirectory() as folder:
        fp32 = Path(folder) / "fp32.onnx"
        graph.save(fp32, note=NOTE)
        store_halves(fp32, models / f"{name}_fp16" / "model.onnx")
        quantize(fp32, models / name / "model.onnx", samples)
    for folder in (models / f"{name}_fp16", models / name):
        write_sum(folder)


def write_sum(folder):
    """Writes the sum of a folder's ONNX file into its manifest."""
    manifest = folder / "model.toml"
    text = manifest.read_text(encoding="utf-8")
    found = sha256_of(folder / "model.onnx")
    manifest.write_text(re.sub(r'^sha256 = ".*"$', f'sha256 = "{found}"', text, flags=re.M), encoding="utf-8")
    print(f"{folder.name}/model.onnx: {(folder / 'model.onnx').stat().st_size / 1e6:.1f} MB, {found}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, required=True, help="the ONNX file that the training began with")
    parser.add_argument("--tuned", type=Path, required=True, action="append", help="what a training wrote")
    parser.add_argument("--name", required=True, help="the name of the network, a folder of models/")
    parser.add_argument("--share", type=float, action="append", help="the share of the change, 1 if none is given")
    options = parser.parse_args()
    shares = options.share or [1.0] * len(options.tuned)
    if len(shares) != len(options.tuned):
        parser.error(f"--share is given {len(shares)} times and --tuned {len(options.tuned)} times; give one for each")
    base = weights_of(options.base)
    weights = mixed(base, [(changed_weights(base, weights_of(f)), share) for f, share in zip(options.tuned, shares)])
    write_networks(options.base, weights, ROOT / "models", options.name, ROOT / "samples")
