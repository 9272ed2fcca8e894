"""How long everything is measured."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Effort:
    """How long everything is measured."""

    name: str
    profiles: tuple[str, ...]
    seconds: float
    """Of a window, at least."""
    rounds: int
    """Of windows that alternate."""
    tune_seconds: float
    """Of a window in the search for the best settings."""
    clients: tuple[int, ...]
    """Clients of the closed loops."""
    loads: tuple[int, ...]
    """Rates of the open loops, percent of the capacity."""
    peer_clients: int
    """Clients when servers are compared."""
    many_clients: tuple[int, ...]
    """Growth with clients."""
    sides: tuple[int, ...]
    """Growth with the frame, pixels."""
    cameras: tuple[int, ...]
    """Growth with cameras."""
    frames: int
    """Frames one after the other, where single frames are timed."""
    starts: int
    """Starts of the server."""
    memory_minutes: float
    """Of steady load while memory is watched."""


FULL = Effort(
    name="full",
    profiles=("fast", "balanced", "paper"),
    seconds=30.0,
    rounds=5,
    tune_seconds=5.0,
    clients=(1, 4, 16, 64),
    loads=(50, 80, 120, 1000),
    peer_clients=16,
    many_clients=(1, 2, 4, 8, 16, 32, 64, 128, 256),
    sides=(600, 960, 1280, 1680, 2240, 3000, 4000),
    cameras=(1, 10, 100, 1000),
    frames=30,
    starts=7,
    memory_minutes=30.0,
)

MEDIUM = replace(
    FULL,
    name="medium",
    seconds=10.0,
    rounds=3,
    tune_seconds=3.0,
    many_clients=(1, 4, 16, 64, 256),
    sides=(600, 960, 1680, 2240, 4000),
    cameras=(1, 100, 1000),
    frames=15,
    starts=5,
    memory_minutes=5.0,
)

SHORT = replace(
    FULL,
    name="short",
    profiles=("fast", "balanced"),
    seconds=3.0,
    rounds=1,
    tune_seconds=1.5,
    clients=(1, 4),
    loads=(80, 1000),
    peer_clients=4,
    many_clients=(1, 16),
    sides=(600, 1680, 4000),
    cameras=(1, 20),
    frames=5,
    starts=3,
    memory_minutes=0.25,
)
