"""The errors of the suite, one class per kind of blame: our input, our rig, or the device."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class ConformanceError(Exception):
    """Base of every error the suite raises on purpose."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake in a file a person wrote.

    Args:
        path: The file.
        line: 1-based line, 0 when the whole file is meant.
        key: Where in the file, as a person would say it (``objects.0x1017.default``).
        text: ``expected …, got …``.
    """

    path: Path
    line: int
    key: str
    text: str

    def __str__(self) -> str:
        place = f"{self.path}:{self.line}" if self.line else str(self.path)
        return f"{place}: {self.key}: {self.text}" if self.key else f"{place}: {self.text}"


class SpecError(ConformanceError):
    """A file or an argument the user gave is wrong; nothing was sent."""

    def __init__(self, *problems: Problem | str) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = problems


class BenchError(ConformanceError):
    """The rig (adapter, bus, power, disk) failed; no verdict on the device follows from it."""


class NodeTimeout(ConformanceError):  # noqa: N818 - CANopen calls the missing answer a timeout
    """The node did not answer within the time allowed."""


class SetupRefused(ConformanceError):  # noqa: N818 - a state of the check, not a fault of anyone
    """The node refused a step that a check needs before it can judge: the check is inconclusive."""


class BenchLacks(SetupRefused):
    """The bench has not what a check turned out to need: it is skipped."""


class HostLate(SetupRefused):
    """The computer alone was too late for a check to judge: it may be tried again.

    Args:
        text: What it was too late for.
        late_ms: By how much it was late.
    """

    def __init__(self, text: str, late_ms: float) -> None:
        super().__init__(text)
        self.late_ms = late_ms


class NotAlone(ConformanceError):  # noqa: N818 - a state of the bench, not a fault of anyone
    """A step of a check would touch other units that are on the bus: it is skipped."""


class NotNow(ConformanceError):  # noqa: N818 - likewise
    """A step of a check would touch other units while they are being judged: it has to wait."""


def first_line(error: Exception) -> str:
    """Return what an error of a library says, in a line; its kind where it says nothing."""
    return next(iter(str(error).strip().splitlines()), type(error).__name__)
