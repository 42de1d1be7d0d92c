"""What is wrong with a bench before anything is judged on it; listening only, unless asked to ask."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, Final

import can

from conformance import resources
from conformance.bench.bus.link import Link
from conformance.bench.bus.listening import Heard, Spread, hear, overshoot, spread
from conformance.bench.bus.trace import Trace
from conformance.bench.definition import BenchDefinition
from conformance.bench.given_back.seeking import answering, said_identity
from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.sdo import SdoPort
from conformance.bench.opening import SILENT, channels, open_bus, why_closed
from conformance.errors import BenchError, NodeTimeout
from conformance.spec.bit_rates import documented_rates
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec, Key, address

ASKED: Final[tuple[Key, ...]] = ((0x1000, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3), (0x1018, 4))

_LISTEN_ELSEWHERE_S: Final = 1.0


@dataclass
class Findings:
    """What was found out about a bench.

    Args:
        bitrate: At which it was looked at, in bit/s.
        channels: Those that python-can finds; only where the bus could not be opened.
        state: Of the adapter's controller.
        heard: While nothing was sent.
        elsewhere: Frames heard at other bit rates, where that could be tried without harm.
        waits: By how much waits of 1 ms were too long.
        late: By how much timestamps of the frames heard may be late.
        asked: What objects hold, by the node-ID that answered; None where nobody was asked.
        kinds: Which devices a node that answered may be, of those that have a spec.
        problem: What to look at, empty when all is well.
    """

    bitrate: int
    channels: list[str] | None = None
    state: str = ""
    heard: Heard | None = None
    elsewhere: dict[int, int] = field(default_factory=dict)
    waits: Spread | None = None
    late: Spread | None = None
    asked: dict[int, dict[str, str]] | None = None
    kinds: dict[int, list[str]] = field(default_factory=dict)
    problem: str = ""


@dataclass(frozen=True)
class Examination:
    """A look at a bench.

    Args:
        definition: The bench.
        bitrate: In bit/s.
        options: Arguments of the interface beyond those in the bench's file.
        seconds: How long to listen.
        ask: Nodes may be asked who they are, which sends.
    """

    definition: BenchDefinition
    bitrate: int
    options: Mapping[str, Any]
    seconds: float
    ask: bool

    def look(self) -> Findings:
        """Look at the bench; whatever is wrong is a finding."""
        found = Findings(self.bitrate)
        try:
            found.problem = self._look(found)
        except BenchError as error:
            found.problem = str(error)
            if isinstance(error.__cause__, Exception) and found.heard is None:
                found.problem = why_closed(self.definition, error)
                found.channels = channels(self.definition.interface)
        return found

    def _look(self, found: Findings) -> str:
        with self._link(self.bitrate, found=found) as link:
            found.waits = overshoot(link)
            found.heard = hear(link, self.seconds)
            found.late = spread(found.heard.late_ms)
            if self.ask and found.heard.frames and not found.heard.errors:
                self._ask(link, found)
        if not found.heard.frames or found.heard.errors:
            self._listen_elsewhere(found)
            if self.ask and not found.elsewhere and not found.heard.errors:
                with self._link(self.bitrate) as link:
                    self._ask(link, found)
        return _judged(found, self.seconds)

    @contextmanager
    def _link(
        self,
        bitrate: int,
        more: Mapping[str, Any] | None = None,
        found: Findings | None = None,
    ) -> Iterator[Link]:
        bus = open_bus(self.definition, bitrate, {**self.options, **(more or {})})
        link = Link(bus, Trace(), bitrate, stamps=self.definition.stamps())
        try:
            yield link
            if found is not None:
                found.state = _state(bus)
        finally:
            with suppress(can.CanError, OSError):
                link.close()

    def _listen_elsewhere(self, found: Findings) -> None:
        """Listen at other bit rates that manuals list, where the adapter can without disturbing anybody."""
        silent = SILENT.get(self.definition.interface)
        if silent is None:
            return
        rates = {rate for spec in known_specs().values() for rate in documented_rates(spec)}
        for rate in sorted(rates - {self.bitrate}, reverse=True):
            with suppress(BenchError), self._link(rate, silent) as link:
                if frames := hear(link, min(self.seconds, _LISTEN_ELSEWHERE_S)).frames:
                    found.elsewhere[rate] = frames

    def _ask(self, link: Link, found: Findings) -> None:
        timeout_s = self.definition.sdo_timeout_s
        found.asked = {}
        specs = known_specs()
        for node_id in answering(link, timeout_s):
            port = SdoPort(SdoChannel(link, node_id, timeout_s))
            held = {key: _upload(port, key) for key in ASKED}
            found.asked[node_id] = {address(*key): _shown(it) for key, it in held.items()}
            found.kinds[node_id] = [name for name, spec in specs.items() if _is_one(spec, held)]


def known_specs() -> dict[str, DeviceSpec]:
    """Return the built-in specs, by name and variant."""
    specs = {}
    for name in resources.names("device_specs"):
        file = load_spec(resources.find("device_specs", name, "DEVICE"))
        specs.update({f"{name} {variant}": file.resolve(variant) for variant in file.variants})
    return specs


def _judged(found: Findings, seconds: float) -> str:
    heard = found.heard
    assert heard is not None  # it was listened
    told = heard.errors or "nothing was heard"
    if found.elsewhere:
        rate = max(found.elsewhere, key=found.elsewhere.__getitem__)
        return (
            f"wrong bit rate: {told} at {found.bitrate} bit/s, but {found.elsewhere[rate]} frames "
            f"at {rate} bit/s: give --bitrate {rate}"
        )
    if heard.errors:
        return (
            f"the bus is in error ({heard.errors}): a wrong bit rate is suspected; otherwise check "
            "wiring, termination and whether any other node is on the bus"
        )
    if found.state not in ("", "active"):
        return f"the adapter's controller is error {found.state}: check bit rate and wiring"
    if found.asked is not None:
        return "" if found.asked else "nobody answers an SDO request: check power and cable"
    if not heard.frames:
        return (
            f"the bus is silent: nothing was heard for {seconds:g} s; a node without heartbeat is "
            "silent too, so ask with --ask, or check power, cable, termination and bit rate"
        )
    return ""


def _state(bus: can.BusABC) -> str:
    """Return the state of the adapter's controller, empty where the driver does not tell."""
    try:
        return bus.state.name.lower()
    except (can.CanError, OSError, AttributeError, NotImplementedError):
        return ""


def _upload(port: SdoPort, key: Key) -> bytes | str:
    try:
        transfer = port.upload(*key)
    except NodeTimeout as error:
        return str(error)
    return str(transfer) if transfer.data is None else transfer.data


def _shown(held: bytes | str) -> str:
    return held if isinstance(held, str) else f"{int.from_bytes(held, 'little'):08X}h"


def _is_one(spec: DeviceSpec, held: Mapping[Key, bytes | str]) -> bool:
    """Tell whether a node is what a spec describes, by all that the spec says of its identity."""
    said = said_identity(spec)
    return bool(said) and all(_number(held[key]) == number for key, number in said.items())


def _number(held: bytes | str) -> int | None:
    return None if isinstance(held, str) else int.from_bytes(held, "little")
