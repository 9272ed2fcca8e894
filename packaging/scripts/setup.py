"""Prepares a build: `setup.py [toolchain] [runtime]`, both by default. ONNX Runtime is the only download.

Other steps are for tests, benchmarks and the models of `make models`; an unknown one is answered with their names.
Nothing is installed outside the repository, and a second run only checks sums. The work is in `assets/`; this file
stays readable to Python interpreters too old for it, so that they can say so.
"""

import sys

OLDEST_PYTHON = (3, 11)


def refusal_of(version):
    """The reason why this Python cannot run the set-up, or None."""
    if tuple(version[:2]) >= OLDEST_PYTHON:
        return None
    return (
        "Lookdown's set-up needs Python %d.%d or newer and this is Python %d.%d; install a newer one and name it: "
        "make setup PYTHON=python3.12" % (OLDEST_PYTHON + tuple(version[:2]))
    )


if __name__ == "__main__":
    refusal = refusal_of(sys.version_info)
    if refusal:
        sys.exit(refusal)
    from assets.main import main

    sys.exit(main(sys.argv[1:]))
