"""The object dictionary: present values, and what an access must satisfy (CiA 301 v4.2.0, 7.4)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import partial

from conformance.simulator.defaults import initial_value
from conformance.simulator.faults import Faults
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.fields import key_of
from conformance.spec.model import Entry, Key, Range, StateName
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import Value
from conformance.wire.errors import WireError

_MOST_OCTETS = 8192

Guard = Callable[[Value], None]
"""Raises SdoAbortError when the value must not be written now; called before the range check."""

Action = Callable[[Value], None]
"""Acts on a value written, after all checks."""


class ObjectDictionary:
    """The entries of one node and their values; services hang their rules on single entries.

    Attributes:
        state: NMT state, for entries that are writable in some states only.
        computed: Entries whose value is asked for at each upload.
        guards: What must hold before an entry is written.
        ranges: Ranges that replace those of the spec.
        adjusts: Changes a value before it is stored.
        actions: Entries whose download starts something instead of storing the value.
        observers: Told of a value stored.

    A setting that takes effect later has two values: that of `value`, which an upload returns, and
    that of `number`, which the device acts on.
    """

    def __init__(
        self,
        entries: Mapping[Key, Entry],
        serial_number: int,
        faults: Faults,
        unstated: Mapping[Key, Value] | None = None,
    ) -> None:
        self.state: StateName = "pre-operational"
        self.computed: dict[Key, Callable[[], Value]] = {}
        self.guards: defaultdict[Key, list[Guard]] = defaultdict(list)
        self.ranges: dict[Key, tuple[Range, ...] | None] = {}
        self.adjusts: dict[Key, Callable[[Value], Value]] = {}
        self.actions: dict[Key, Action] = {}
        self.observers: defaultdict[Key, list[Action]] = defaultdict(list)
        self._entries = entries
        self._indices = {index for index, _ in entries}
        self._faults = faults
        self._unchecked = {key_of(place) for place in faults.accepts_out_of_range_at}
        self._defaults = {
            key: initial_value(entry, serial_number, faults) for key, entry in entries.items()
        }
        self._defaults.update(unstated or {})
        self._values = dict(self._defaults)
        self._in_force: dict[Key, Value] = {}
        self.load({})
        self._watch_limits()

    @property
    def entries(self) -> Mapping[Key, Entry]:
        """The documented entries."""
        return self._entries

    def default(self, key: Key) -> Value:
        """Return the value an entry has when nothing was stored."""
        return self._defaults[key]

    def value(self, key: Key) -> Value:
        """Return the present value of an entry."""
        compute = self.computed.get(key)
        return self._values[key] if compute is None else compute()

    def number(self, index: int, sub: int = 0) -> int:
        """Return the present value of an integer entry, 0 when there is no such entry."""
        key = index, sub
        if key not in self._entries:
            return 0
        value = self._in_force[key] if key in self._in_force else self.value(key)
        return value if isinstance(value, int) else 0

    def set(self, key: Key, value: Value) -> None:
        """Set a value from inside the device: no checks, observers are told."""
        self._values[key] = value
        for observe in self.observers.get(key, ()):
            observe(value)

    def pretend(self, key: Key, number: int) -> None:
        """Act as if an entry held a number, until the next restart; an upload returns its value."""
        self._in_force[key] = number

    def load(self, values: Mapping[Key, Value]) -> None:
        """Take over values as at start-up; those that no longer exist are left out."""
        self._values.update({key: values[key] for key in values if key in self._entries})
        for key, entry in self._entries.items():
            if entry.effective != "at-once":
                acts = not self._faults.stored_values_never_act
                self._in_force[key] = self._values[key] if acts else self._defaults[key]

    def stored(self, key: Key) -> None:
        """Note that a value was stored; one that waits for that takes effect."""
        acts = not self._faults.stored_values_never_act
        if self._entries[key].effective == "after-store" and acts:
            self._in_force[key] = self._values[key]

    def changed(self) -> dict[Key, Value]:
        """Return the stored values that differ from their defaults."""
        defaults = self._defaults
        return {key: value for key, value in self._values.items() if value != defaults[key]}

    def data(self, key: Key) -> bytes:
        """Return the present value of an entry as an SDO or PDO carries it."""
        return self._entries[key].type.encode(self.value(key))

    def upload(self, key: Key) -> bytes:
        """Return what an SDO upload answers.

        Raises:
            SdoAbortError: The entry cannot be read.
        """
        entry = self._entries.get(key)
        if entry is None or entry.reserved:
            if self._reads_as_zero(key):
                return bytes(4)
            raise self._absent(key)
        if entry.optional and self._faults.optional_entries_abort:
            raise SdoAbortError(AbortCode.DEVICE_STATE)
        if entry.access == "wo" and not self._faults.reads_write_only:
            raise SdoAbortError(AbortCode.READ_OF_WRITE_ONLY)
        if entry.reads == "in-force" and key in self._in_force:
            return entry.type.encode(self._in_force[key])
        return self.data(key)

    def accept(self, key: Key, size: int | None) -> None:
        """Check what can be checked before the data of a download have come.

        Args:
            key: Index and sub-index.
            size: Bytes announced, None when not.

        Raises:
            SdoAbortError: The entry cannot be written, or not with so many bytes.
        """
        entry = self._entries.get(key)
        if entry is None or entry.reserved:
            raise self._absent(key)
        if entry.access in ("ro", "const"):
            if self._faults.accepts_read_only:
                return
            raise SdoAbortError(AbortCode.WRITE_OF_READ_ONLY)
        locked = entry.writable_in is not None and self.state not in entry.writable_in
        if locked and not self._faults.accepts_in_any_state:
            raise SdoAbortError(AbortCode.DEVICE_STATE)
        if size is not None and not self._faults.accepts_wrong_length:
            _check_length(entry, size)

    def most_octets(self, key: Key) -> int:
        """Return how many bytes a download to an entry may have at most."""
        return _octets(self._entries[key])[1]

    def download(self, key: Key, data: bytes, *, padded: bool = False) -> None:
        """Write a value that came by SDO.

        Args:
            key: Index and sub-index.
            data: The bytes.
            padded: Expedited without size: ``data`` may be longer than the entry.

        Raises:
            SdoAbortError: The entry cannot be written, or not with this value.
        """
        entry = self._entries.get(key)
        size = None if entry is None else entry.type.size
        if size is not None and (padded or self._faults.accepts_wrong_length):
            data = data[:size] if padded else data[:size].ljust(size, b"\0")
        self.accept(key, len(data))
        assert entry is not None  # else accept() has refused
        if not entry.writable:
            return
        try:
            value = entry.type.decode(data)
        except WireError as error:
            raise SdoAbortError(AbortCode.INVALID_VALUE) from error
        for guard in self.guards.get(key, ()):
            guard(value)
        self._check_range(entry, value)
        if self._may_change(entry, value):
            self._write(key, value)

    def _may_change(self, entry: Entry, value: Value) -> bool:
        """Return whether a value is written, given what other entries hold."""
        conditions = [it for it in entry.writable_while if it.key in self._entries]
        met = all(condition.holds(self.number(*condition.key)) for condition in conditions)
        if met or value == self.value(entry.key) or self._faults.accepts_in_any_state:
            return True
        if entry.otherwise == "refused":
            raise SdoAbortError(AbortCode.DEVICE_STATE)
        return False

    def _watch_limits(self) -> None:
        """Let an entry whose value limits another one mind what that holds."""
        for entry in self._entries.values():
            limits = entry.limits_by
            if limits is None:
                continue
            if self._faults.limit_conflict_clears:
                self.observers[limits.key].append(partial(self._lower, entry))
            elif limits.conflict == "refused":
                self.guards[limits.key].append(partial(self._check_limited, entry))
            elif limits.conflict == "lowered":
                self.observers[limits.key].append(partial(self._lower, entry))

    def _check_limited(self, entry: Entry, value: Value) -> None:
        if entry.limits_by is not None:
            _check(entry.limits_by.ranges.get(int(value)), self._written(entry.key))

    def _lower(self, entry: Entry, value: Value) -> None:
        ranges = entry.limits_by.ranges.get(int(value)) if entry.limits_by is not None else None
        if ranges is not None:
            most = max(high for _, high in ranges)
            if self._written(entry.key) > most:
                self.set(entry.key, 0 if self._faults.limit_conflict_clears else most)

    def _write(self, key: Key, value: Value) -> None:
        if self._faults.od_readback_stale in ("everywhere", key[0]):
            return
        act = self.actions.get(key)
        if act is not None:
            act(value)
            return
        adjust = self.adjusts.get(key)
        kept = value if adjust is None else adjust(value)
        if kept == value or kept != self._values[key]:  # else it was dropped, which nobody notes
            self.set(key, kept)

    def _check_range(self, entry: Entry, value: Value) -> None:
        unchecked = self._faults.accepts_out_of_range or entry.key in self._unchecked
        if not isinstance(value, int) or unchecked:
            return
        _check(self.ranges.get(entry.key, entry.legal), value)
        if entry.limits_by is not None:
            _check(entry.limits_by.ranges.get(self._written(entry.limits_by.key)), value)

    def _written(self, key: Key) -> int:
        """Return the present value of an integer entry, whether in force or not."""
        value = self.value(key)
        return value if isinstance(value, int) else 0

    def _reads_as_zero(self, key: Key) -> bool:
        if key[0] in self._indices:
            return self._faults.unknown_sub_reads_zero
        return self._faults.unknown_object_reads_zero

    def _absent(self, key: Key) -> SdoAbortError:
        if key[0] not in self._indices or (
            key in self._entries and not self._entries[key].in_record
        ):
            return SdoAbortError(AbortCode.OBJECT_DOES_NOT_EXIST)
        return SdoAbortError(AbortCode.SUB_INDEX_DOES_NOT_EXIST)


def _octets(entry: Entry) -> Range:
    size = entry.type.size
    return (size, size) if size is not None else entry.octets or (0, _MOST_OCTETS)


def _check_length(entry: Entry, size: int) -> None:
    least, most = _octets(entry)
    if size > most:
        raise SdoAbortError(AbortCode.LENGTH_TOO_HIGH)
    if size < least:
        raise SdoAbortError(AbortCode.LENGTH_TOO_LOW)


def _check(ranges: tuple[Range, ...] | None, value: int) -> None:
    if ranges is None or any(low <= value <= high for low, high in ranges):
        return
    if all(low == high for low, high in ranges):
        raise SdoAbortError(AbortCode.INVALID_VALUE)
    if value > max(high for _, high in ranges):
        raise SdoAbortError(AbortCode.VALUE_TOO_HIGH)
    if value < min(low for low, _ in ranges):
        raise SdoAbortError(AbortCode.VALUE_TOO_LOW)
    raise SdoAbortError(AbortCode.INVALID_VALUE)
