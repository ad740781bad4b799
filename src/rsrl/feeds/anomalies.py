"""What is wrong with a source: counted by kind, with a few examples, however long the source is."""

from collections import Counter
from typing import Final

__all__ = ["Anomalies"]

MOST_EXAMPLES: Final = 20
LONGEST_EXAMPLE: Final = 120
"""Characters of an example that are kept."""


class Anomalies:
    """Faults that a reader met and left out.

    Attributes:
        counts: faults by kind, such as "bad line". Kinds are words of the readers, so there are few.
        examples: the first `MOST_EXAMPLES` faults in words, and the first one of each kind.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.examples: list[str] = []

    def add(self, kind: str, detail: str = "") -> bool:
        """Count a fault; whether it is the first of its kind."""
        self.counts[kind] += 1
        first = self.counts[kind] == 1
        if first or len(self.examples) < MOST_EXAMPLES:
            self.examples.append(f"{kind}: {detail[:LONGEST_EXAMPLE]}" if detail else kind)
        return first

    def summary(self) -> str:
        """All kinds with their counts in one line; empty where there are none."""
        return ", ".join(f"{kind} {count}" for kind, count in self.counts.most_common())
