"""A device and the model of it in lock-step: one step after the other, until they differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from conformance.explore.answers import Answers
from conformance.explore.measured import Measured
from conformance.explore.side import Outcome, Side
from conformance.explore.steps import Download, Step, Upload, words
from conformance.explore.streams import Heard, Streams, Unlike
from conformance.spec.model import DeviceSpec
from conformance.wire import cob_id
from conformance.wire.nmt import NmtState

TOLERANCE_S: Final = 0.02
"""On a virtual clock: what an arbitration lost and an answer sooner or later make of a time."""

REAL_TOLERANCE_S: Final = 0.3
"""In real time, where two clocks run."""

_REGISTER: Final = 3
"""Octets of an EMCY before those of the manufacturer."""


@dataclass(frozen=True, slots=True)
class Difference:
    """What a device did that the model did not.

    Args:
        quantity: What differs.
        expected: What the model did.
        actual: What the device did.
    """

    quantity: str
    expected: str
    actual: str


class Pair:
    """A device and its model.

    Args:
        device: The device under test.
        model: A simulated device.
        spec: What the manual says, as the model has it.
    """

    def __init__(self, device: Side, model: Side, spec: DeviceSpec) -> None:
        self.device = device
        self._model = model
        self._spec = spec
        real = device.bench.link.real_time
        self._tolerance_s = REAL_TOLERANCE_S if real else TOLERANCE_S
        self._streams = Streams(self._tolerance_s, self._same)
        self._answers = Answers(spec)
        self._measured = Measured(model.node, spec)
        self._count = 0
        self.parted = False
        """Both did what the manual allows, but not the same: nothing more can be told."""

    def take(self, step: Step) -> Difference | None:
        """Take both through a step and return what differs."""
        self._count += 1
        self._measured.expect(step)
        got, wanted = self.device.do(step), self._model.do(step)
        found = self._outcomes(step, wanted, got)
        if wanted.booted or got.booted:
            self._streams.forget()
            self._answers.forget()
        return found or self._frames()

    def end(self) -> Difference | None:
        """Wait for what may still come and return what differs."""
        until_s = max(self.device.elapsed_s, self._model.elapsed_s) + 2 * self._tolerance_s
        self.device.listen_until(until_s)
        found = self._frames()
        more = self.device.unsolicited - self._model.unsolicited
        if found is None and more > 0:
            return Difference("SDO responses that nobody asked for", "none", str(more))
        return found

    def close(self) -> None:
        """Close the model's bench."""
        self._model.close()

    def _outcomes(self, step: Step, wanted: Outcome, got: Outcome) -> Difference | None:
        what = words(step, self._spec)
        if isinstance(step, Upload | Download) and wanted.transfer and got.transfer:
            self.parted = self._answers.left_open(step, wanted.transfer, got.transfer)
            told = self._answers.difference(step, wanted.transfer, got.transfer)
            if told is not None and not self.parted:
                return Difference(f"answer to {what}", *told)
        if wanted.booted != got.booted and not self.parted:
            return Difference(f"boot-up message after: {what}", *map(_booted, (wanted, got)))
        return None

    def _frames(self) -> Difference | None:
        """Bring both to the same time and return what differs of what they sent."""
        until_s = max(self.device.elapsed_s, self._model.elapsed_s)
        for side in (self.device, self._model):
            side.listen_until(until_s)
        for frame, time_s in self._model.heard():
            self._streams.of_model(Heard(frame, time_s, self._count))
        for frame, time_s in self.device.heard():
            self._streams.of_device(Heard(frame, time_s, self._count))
        for unlike in self._streams.unlike(until_s):
            if self._counts(unlike) and not self.parted:
                return self._named(unlike)
        return None

    def _counts(self, unlike: Unlike) -> bool:
        """Tell whether frames say something of the device: errors of unknown surroundings do not."""
        heard = unlike.model or unlike.device
        is_emcy = heard is not None and self._is_emcy(heard)
        return self.device.surroundings or not is_emcy

    def _same(self, model: Heard, device: Heard) -> bool:
        wanted, got = model.frame, device.frame
        if wanted == got or model.step != device.step:
            return True
        if len(wanted.data) != len(got.data):
            return False
        if self._is_emcy(model):
            return self._emcy_told(wanted.data) == self._emcy_told(got.data)
        mask = self._measured.bits(wanted.can_id)
        numbers = (int.from_bytes(it.data, "little") & ~mask for it in (wanted, got))
        return len(set(numbers)) == 1

    def _is_emcy(self, heard: Heard) -> bool:
        return heard.frame.can_id == cob_id.emcy(self._spec.node_id)

    def _emcy_told(self, data: bytes) -> bytes:
        """Return the octets of an EMCY that the manual tells."""
        emcy = self._spec.services.emcy_producer
        if emcy is None or emcy.other_octets == "zero":
            return data
        place = emcy.manufacturer_code
        own = b"" if place is None else data[_REGISTER + place.octet :][:1]
        return data[:_REGISTER] + own

    def _named(self, unlike: Unlike) -> Difference:
        heard = unlike.model or unlike.device
        assert heard is not None  # one of them came
        what = f"frame {heard.frame.can_id:03X}h"
        if heard.frame.can_id == cob_id.heartbeat(self._spec.node_id):
            what = "boot-up message" if heard.frame.data == b"\0" else "heartbeat"
        elif self._is_emcy(heard):
            what = "EMCY"
        return Difference(what, _shown(unlike.model), _shown(unlike.device))


def _booted(outcome: Outcome) -> str:
    return "a boot-up message" if outcome.booted else "none"


def _shown(heard: Heard | None) -> str:
    if heard is None:
        return "none"
    frame = heard.frame
    known = {int(state): state.name.lower().replace("_", "-") for state in NmtState}
    state = known.get(frame.data[0]) if 0x700 < frame.can_id < 0x780 and frame.data else None
    return f"{frame}{f' ({state})' if state else ''}, {heard.time_s * 1000:.0f} ms after the start"
