"""Waits for a state, never for a time."""

import time
from collections.abc import Callable

PATIENCE_SECONDS = 15.0
LOOKS_PER_SECOND = 50.0


def wait_until(holds: Callable[[], object], what: str, seconds: float = PATIENCE_SECONDS) -> object:
    """What holds at last; an `AssertionError` that says what was waited for if nothing does."""
    deadline = time.monotonic() + seconds
    while not (found := holds()):
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {seconds:.0f} s in vain until {what}")
        time.sleep(1.0 / LOOKS_PER_SECOND)
    return found
