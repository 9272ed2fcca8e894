"""Messages and errors of the set-up."""


class SetupError(Exception):
    """An error that stops the set-up; the message has the reason and the remedy."""


def say(step: str, text: str) -> None:
    """Prints one line of a step."""
    print(f"{step:<10} {text}", flush=True)


def megabytes(size: int) -> str:
    """Formats a number of bytes."""
    return f"{size / 1e6:.1f} MB"
