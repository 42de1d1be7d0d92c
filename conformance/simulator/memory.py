"""What survives a power cycle: the non-volatile memory of a device."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from conformance.spec.model import Key
from conformance.wire.datatypes import Value


@dataclass(slots=True)
class NonVolatileMemory:
    """Non-volatile memory.

    Attributes:
        serial_number: UNSIGNED32.
        node_id: 1..127, for a device without an object that holds it.
        bitrate: In bit/s, for a device without an object that holds it.
        values: Stored values that differ from the defaults.
        agreed: What both objects of a pair last held, by the first one; None for the default.
        defaults_once: Entries that start with their default at the next reset, stored or not.
        history: Error codes, latest first.
    """

    serial_number: int
    node_id: int
    bitrate: int
    values: dict[Key, Value] = field(default_factory=dict)
    agreed: dict[Key, Value | None] = field(default_factory=dict)
    defaults_once: set[Key] = field(default_factory=set)
    history: list[int] = field(default_factory=list)

    def keep(self, values: Mapping[Key, Value | None]) -> None:
        """Store values; None for those that are to have their default again."""
        for key, value in values.items():
            if value is None:
                self.values.pop(key, None)
            else:
                self.values[key] = value

    def start_values(self, scope: range) -> dict[Key, Value]:
        """Return the values that the object dictionary starts with instead of the defaults.

        Args:
            scope: Indices that are being reset; the defaults asked for once among them are used up.
        """
        skipped = self.defaults_once
        values = {key: value for key, value in self.values.items() if key not in skipped}
        self.defaults_once = {key for key in skipped if key[0] not in scope}
        return values
