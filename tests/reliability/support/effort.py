"""How long everything is tried."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """How long everything is tried."""

    name: str
    examples: int
    """Requests that schemathesis makes up for each operation, in each of its phases."""
    deterministic: bool
    """Whether schemathesis makes up the same ones in every run."""
    kills: int
    """Of the server while it writes calibrations."""
    stops: int
    """Of the server under load."""
    overload_seconds: float
    rude_clients: int
    """Of each kind, at the same time."""
    huge_frames: int
    """Of each kind."""
    soak_seconds: float


SHORT = Effort(
    name="short",
    examples=25,
    deterministic=True,
    kills=30,
    stops=3,
    overload_seconds=8.0,
    rude_clients=100,
    huge_frames=5,
    soak_seconds=20.0,
)

LONG = Effort(
    name="long",
    examples=2000,
    deterministic=False,
    kills=1000,
    stops=100,
    overload_seconds=60.0,
    rude_clients=400,
    huge_frames=100,
    soak_seconds=1800.0,
)
