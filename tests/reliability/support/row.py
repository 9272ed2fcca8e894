"""The result of a proof."""

from dataclasses import asdict, dataclass, field


@dataclass
class Row:
    """What was done, the observations, and the faults: there are none if the proof holds."""

    name: str
    done: str
    """The description, with the number of repetitions."""
    seen: str = ""
    """Figures."""
    faults: list[str] = field(default_factory=list)
    skipped: str = ""
    """The reason why this machine cannot run it."""

    def require(self, holds: bool, otherwise: str) -> None:
        """Records a fault unless the condition holds."""
        if not holds:
            self.faults.append(otherwise)

    def as_json(self) -> dict:
        """The row as JSON."""
        return asdict(self)

    def verdict(self) -> str:
        """The verdict in one word."""
        if self.skipped:
            return "skipped"
        return "FAILED" if self.faults else "held"
