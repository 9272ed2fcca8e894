"""The duration of measurements."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Effort:
    """The duration of measurements."""

    name: str
    profiles: tuple[str, ...]
    seconds: float
    """The minimum duration of a window."""
    rounds: int
    """The number of alternating windows."""
    tune_seconds: float
    """The duration of a window in the search for the best settings."""
    clients: tuple[int, ...]
    """The numbers of clients of closed loops."""
    loads: tuple[int, ...]
    """The rates of open loops, percent of the capacity."""
    peer_clients: int
    """The number of clients for comparisons of servers."""
    cameras: tuple[int, ...]
    """The numbers of cameras."""
    frames: int
    """The number of consecutive frames for timings of single frames."""
    starts: int
    """The number of server starts."""


FULL = Effort(
    name="full",
    profiles=("fast", "balanced"),
    seconds=15.0,
    rounds=3,
    tune_seconds=3.0,
    clients=(1, 4, 16),
    loads=(80, 120, 1000),
    peer_clients=16,
    cameras=(1, 4, 100, 1000),
    frames=30,
    starts=5,
)

SHORT = replace(
    FULL,
    name="short",
    seconds=3.0,
    rounds=1,
    tune_seconds=1.5,
    clients=(1, 4),
    loads=(80, 1000),
    peer_clients=4,
    cameras=(1, 4),
    frames=5,
    starts=3,
)
