"""Packs the weights of tuned models that differ from those of their source, in half precision.

    python lab/training/pack.py --base models/nanodet_g_416/model.onnx --tuned WORK/runs/first/averaged.onnx --out weights.npz

`--tuned FILE --share 0.5` takes that part of the change by a training: less is learned, and less of the source is
forgotten. Both may be given several times; the changes are added. A tuned file is an ONNX file or an archive of this
program.

The set-up puts the weights into the graph of the source again (scripts/convert/replace_weights.py). The same files give
the same bytes.
"""

import argparse
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper


def weights_of(file):
    """The constants of an ONNX file by name, or the weights of an archive."""
    if file.suffix == ".npz":
        with np.load(file) as archive:
            return dict(archive)
    return {tensor.name: numpy_helper.to_array(tensor) for tensor in onnx.load(file).graph.initializer}


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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, required=True, help="the ONNX file that the training began with")
    parser.add_argument("--tuned", type=Path, required=True, action="append", help="what a training wrote")
    parser.add_argument("--out", type=Path, required=True, help="the archive to write, .npz")
    parser.add_argument("--share", type=float, action="append", help="the share of the change, 1 if none is given")
    options = parser.parse_args()
    shares = options.share or [1.0] * len(options.tuned)
    if len(shares) != len(options.tuned):
        parser.error(f"--share is given {len(shares)} times and --tuned {len(options.tuned)} times; give one for each")
    base = weights_of(options.base)
    packed = mixed(base, [(changed_weights(base, weights_of(f)), share) for f, share in zip(options.tuned, shares)])
    np.savez(options.out, **packed)
    print(f"{options.out}: {len(packed)} weights, {options.out.stat().st_size / 1e6:.1f} MB")
