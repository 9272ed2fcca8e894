"""Packs the weights of a tuned model that differ from those of its source, in half precision.

    python lab/training/pack.py --base models/nanodet_g_416/model.onnx --tuned WORK/runs/first/averaged.onnx --out weights.npz

With `--share`, only that part of the difference is taken: less is learned, and less of the source is forgotten.

The set-up puts them into the graph of the source again (scripts/convert/replace_weights.py). The same files give the
same bytes.
"""

import argparse
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper


def weights_of(file):
    """The constants of an ONNX file by name."""
    return {tensor.name: numpy_helper.to_array(tensor) for tensor in onnx.load(file).graph.initializer}


def changed_weights(base, tuned, share=1.0):
    """The weights of `tuned` that differ from those of `base`, in half precision, with a share of the difference."""
    if set(base) != set(tuned):
        raise SystemExit("The files have different weights; the tuned model must be exported from the base model.")
    changed = {name: value for name, value in tuned.items() if not np.array_equal(value, base[name])}
    packed = {name: value.astype(np.float16) for name, value in changed.items()}
    if not all(np.isfinite(value).all() for value in packed.values()):
        raise SystemExit("A weight is too large for half precision.")
    if share == 1:
        return packed
    halves = {name: value.astype(np.float32) for name, value in packed.items()}
    return {name: (base[name] + share * (value - base[name])).astype(np.float16) for name, value in halves.items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, required=True, help="the ONNX file that the training began with")
    parser.add_argument("--tuned", type=Path, required=True, help="the ONNX file that the training wrote")
    parser.add_argument("--out", type=Path, required=True, help="the archive to write, .npz")
    parser.add_argument("--share", type=float, default=1.0, help="the share of the difference, 0 to 1")
    options = parser.parse_args()
    packed = changed_weights(weights_of(options.base), weights_of(options.tuned), options.share)
    np.savez(options.out, **packed)
    print(f"{options.out}: {len(packed)} weights, {options.out.stat().st_size / 1e6:.1f} MB")
