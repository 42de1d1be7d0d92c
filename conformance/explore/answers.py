"""SDO answers of a device beside those of the model: what the manual leaves open is no difference."""

from __future__ import annotations

from collections.abc import Collection

from conformance.bench.node.sdo import Transfer
from conformance.checks import cases
from conformance.explore.steps import Download, Upload
from conformance.spec.model import DeviceSpec, Entry, Key, is_legal
from conformance.wire.abort import AbortCode, describe


class Answers:
    """Holds the SDO answers of a device against those of the model.

    Args:
        spec: What the manual says.
    """

    def __init__(self, spec: DeviceSpec) -> None:
        self._spec = spec
        self._written: set[Key] = set()

    def forget(self) -> None:
        """Note a restart: what was written may be lost."""
        self._written.clear()

    def left_open(self, step: Upload | Download, model: Transfer, device: Transfer) -> bool:
        """Tell whether both did what the manual allows, but not the same, so that they part here."""
        entry = self._spec.entry(*step.key)
        apart = isinstance(step, Download) and model.confirmed != device.confirmed
        if not apart or entry is None or not (model.answered and device.answered):
            return False
        return entry.optional or (device.refused and entry.legal is None)

    def difference(
        self, step: Upload | Download, model: Transfer, device: Transfer
    ) -> tuple[str, str] | None:
        """Return what was expected and what came, None where the answer is allowed."""
        if isinstance(step, Download) and model.confirmed:
            self._written.add(step.key)
        expected = self._expected(step, model)
        if not model.answered or not device.answered:
            return None if model.answered == device.answered else (expected, str(device))
        if device.fault:
            return expected, str(device)
        if model.confirmed and device.confirmed:
            same = isinstance(step, Download) or self._same(step.key, model, device)
            return None if same else (expected, str(device))
        if model.refused and device.refused:
            codes = self._codes(step, model.abort)
            if not codes or device.abort in codes:
                return None
            return " or ".join(f"abort {describe(code)}" for code in codes), str(device)
        return None if self._may_differ(step) else (expected, str(device))

    def _expected(self, step: Upload | Download, model: Transfer) -> str:
        if not model.answered:
            return "no SDO response"
        if model.refused:
            return "an abort"
        if isinstance(step, Upload) and not self.is_told(step.key):
            return "an upload"
        return str(model)

    def is_told(self, key: Key) -> bool:
        """Tell whether the manual, or what was written, says what an entry holds."""
        entry = self._spec.entry(*key)
        if entry is None or entry.kind in ("live", "counter") or entry.follows is not None:
            return False
        return (entry.default is not None and not entry.on_label) or key in self._written

    def _same(self, key: Key, model: Transfer, device: Transfer) -> bool:
        entry = self._spec.entry(*key)
        if self.is_told(key):
            return model.data == device.data
        size = None if entry is None else entry.type.size
        return size is None or len(device.data or b"") == size or not device.sized

    def _may_differ(self, step: Upload | Download) -> bool:
        """Tell whether one may confirm what the other refuses."""
        entry = self._spec.entry(*step.key)
        return entry is not None and (entry.optional or cases.is_history(entry, self._spec))

    def _codes(self, step: Upload | Download, code: int | None) -> Collection[AbortCode]:
        """Return what CiA 301 allows where one thing alone is wrong; nothing where it is not told."""
        reasons = _reasons(step, self._spec.entry(*step.key))
        allowed = tuple(dict.fromkeys(it for codes in reasons for it in codes))
        return allowed if code in allowed else ()


def _reasons(step: Upload | Download, entry: Entry | None) -> list[tuple[AbortCode, ...]]:
    """Return the codes for each thing that is wrong with a request."""
    if entry is None or entry.reserved:
        return []
    if isinstance(step, Upload):
        return [] if entry.readable else [cases.REFUSED_READ]
    reasons: list[tuple[AbortCode, ...]] = [] if entry.writable else [cases.REFUSED_WRITE]
    size = entry.type.size
    if size is not None and len(step.data) != size:
        reasons.append(cases.WRONG_LENGTH)
    elif entry.type.is_integer:
        value = entry.type.decode(step.data)
        if isinstance(value, int) and not is_legal(value, entry.legal):
            reasons.append(cases.OUT_OF_RANGE)
    return reasons
