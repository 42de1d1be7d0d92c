"""A node's LSS address, and the requests that are for it, or just not for it (CiA 305 v3.0, 6.3 and 6.7)."""

from __future__ import annotations

from dataclasses import astuple, dataclass

from conformance.errors import SetupRefused
from conformance.wire.lss import IdentifyRemoteSlave, LssCommand, MasterMessage, SwitchSelective

_ALL = 0xFFFF_FFFF
_HIGH_LIMITS = (LssCommand.IDENTIFY_REVISION_HIGH, LssCommand.IDENTIFY_SERIAL_HIGH)


@dataclass(frozen=True, slots=True)
class LssAddress:
    """The four numbers of 1018h."""

    vendor: int
    product: int
    revision: int
    serial: int

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers in the order of 1018h."""
        return astuple(self)

    def select(self, serial: int | None = None) -> list[MasterMessage]:
        """Return the messages that select this node, or its twin with another serial number."""
        return _selection(*self.numbers[:3], self.serial if serial is None else serial)

    def select_other(self, *foreign: int) -> list[MasterMessage]:
        """Return messages that select nobody: some of the four numbers, 0 to 3, are another's."""
        return _selection(*(it ^ 1 if n in foreign else it for n, it in enumerate(self.numbers)))

    def search(
        self, *, exact: bool = False, excluded_by: LssCommand | None = None
    ) -> list[MasterMessage]:
        """Return a search for slaves that includes this node.

        Args:
            exact: The ranges include no other revision and serial number.
            excluded_by: The number or limit that keeps the node out of it after all.
        """
        own = (self.vendor, self.product, *[self.revision] * 2, *[self.serial] * 2)
        wide = (self.vendor, self.product, 0, _ALL, 0, _ALL)
        first = LssCommand.IDENTIFY_VENDOR
        numbers = {LssCommand(first + n): it for n, it in enumerate(own if exact else wide)}
        if excluded_by is not None:
            step = -1 if excluded_by in _HIGH_LIMITS else 1
            numbers[excluded_by] = own[excluded_by - first] + step
            if not 0 <= numbers[excluded_by] <= _ALL:
                raise SetupRefused(f"there is no number beyond {own[excluded_by - first]:08X}h")
        return [IdentifyRemoteSlave(command, number) for command, number in numbers.items()]


def _selection(*numbers: int) -> list[MasterMessage]:
    first = LssCommand.SWITCH_SELECTIVE_VENDOR
    return [SwitchSelective(LssCommand(first + n), number) for n, number in enumerate(numbers)]
