"""What came of a proof."""

from dataclasses import asdict, dataclass, field


@dataclass
class Row:
    """What was done, what was seen, and what was wrong: nothing, if the proof holds."""

    name: str
    done: str
    """What was done, and how often."""
    seen: str = ""
    """Figures."""
    faults: list[str] = field(default_factory=list)
    skipped: str = ""
    """Why it cannot be done on this machine."""

    def require(self, holds: bool, otherwise: str) -> None:
        """Notes a fault unless something holds."""
        if not holds:
            self.faults.append(otherwise)

    def as_json(self) -> dict:
        """For a file."""
        return asdict(self)

    def verdict(self) -> str:
        """One word."""
        if self.skipped:
            return "skipped"
        return "FAILED" if self.faults else "held"
