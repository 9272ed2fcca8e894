"""What the set-up says, and how it stops."""


class SetupError(Exception):
    """Something that keeps the set-up from going on; the message says what, and what to do about it."""


def say(step: str, text: str) -> None:
    """Prints one line of a step."""
    print(f"{step:<10} {text}", flush=True)


def megabytes(size: int) -> str:
    """A number of bytes for people."""
    return f"{size / 1e6:.1f} MB"
