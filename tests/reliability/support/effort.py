"""The extent of the proofs."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """The extent of the proofs."""

    name: str
    examples: int
    """Generated requests of schemathesis for each operation, in each of its phases."""
    deterministic: bool
    """True if schemathesis generates the same requests in every run."""
    kills: int
    """Kills of the server while it writes calibrations."""
    stops: int
    """Stops of the server under load."""
    overload_seconds: float
    rude_clients: int
    """Clients of each kind at the same time."""
    huge_frames: int
    """Frames of each kind."""
    soak_seconds: float
    flood_clients: int
    """Clients of each flood at the same time."""
    flood_seconds: float


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
    flood_clients=700,
    flood_seconds=4.0,
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
    flood_clients=1000,
    flood_seconds=30.0,
)
