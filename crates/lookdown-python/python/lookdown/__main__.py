"""The command `lookdown` and `python -m lookdown`."""

import signal
import sys

from lookdown import _lookdown
from lookdown._files import use_packaged_files


def main() -> int:
    """Runs the command line of this process and returns its exit status."""
    use_packaged_files()
    # Python's handler would only take note of Ctrl-C, and end nothing.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return 0 if _lookdown.run(["lookdown", *sys.argv[1:]]) else 1


if __name__ == "__main__":
    sys.exit(main())
