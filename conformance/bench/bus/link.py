"""The link to the bus: one clock, one pump, every frame recorded."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeAlias

import can

from conformance.bench.bus.bus_time import BusTime
from conformance.bench.bus.other_units import OtherUnits
from conformance.bench.bus.stamps import SLICE_S, Stamps, WallClock
from conformance.bench.bus.trace import Trace
from conformance.bench.bus.trouble import Trouble
from conformance.bench.surroundings.rig import SimulatedRig, Surroundings
from conformance.errors import BenchError, first_line
from conformance.messages import to_frame, to_message
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame, bit_length, priority

CLOCK_STEP_S = 1e-6
"""What is left of a wait below this is over: clocks count in steps."""

SENT_WITHIN_S = 0.03
"""What an adapter was told to send is on the bus within this, at 10 kbit/s too."""

MOST_KEPT = 1_000_000
"""Frames of one check; each takes memory, and no check needs nearly as many."""

Match: TypeAlias = Callable[[Frame], bool]

BREAK_S = 2e-4
"""Between frames that follow each other without a break adapters see no more than this."""

DRIFT = 1e-4
"""Clocks of adapters and computers go apart more slowly than this, in proportion to the time."""

_NODE_ID = 0x7F


@dataclass(frozen=True, slots=True)
class Stamped:
    """A frame on the bus.

    Args:
        frame: The frame.
        time_s: Timestamp in seconds on the bus' clock.
        line: Its line in the trace.
        place: Its place in the sequence of frames since the last `forget`, a mark.
        received: False for a frame that the bench sent.
        late_ms: By how much the timestamp may be late, in ms.
    """

    frame: Frame
    time_s: float
    line: int
    place: int
    received: bool
    late_ms: float = 0.0


class Link:
    """Sends and receives frames; waiting is only ever done here.

    Frames received since the last `forget` are kept, so that an observer can look back to a mark
    and no frame is lost to whoever happened to wait when it came.

    Args:
        bus: An open python-can bus; closed with the link.
        trace: Where every frame is recorded.
        bitrate: In bit/s.
        reopen: Opens the bus again at a bit rate; None where the bit rate is not ours to set.
        stamps: What is known about the times of frames; all when None, as of a simulated bus.
        around: What is around devices that are simulated elsewhere.

    Attributes:
        trouble: What the adapter told of its bus.
        interventions: How often the bench had its hands on what is around the node.
        others: Other units on the bus; None where there are none.
    """

    def __init__(
        self,
        bus: can.BusABC,
        trace: Trace,
        bitrate: int,
        reopen: Callable[[int], can.BusABC] | None = None,
        stamps: Stamps | None = None,
        around: Surroundings | None = None,
    ) -> None:
        self.others: OtherUnits | None = None
        self._free_s = -math.inf
        self._trace = trace
        self._reopen = reopen
        self._frames: list[Stamped] = []
        self._around = around
        self._take_up(bus)
        self._offset_s = 0.0 if self.simulated else time.time() - time.monotonic()
        self._met_s: float | None = None
        self.stamps = stamps or Stamps("bus", 0.0)
        self.stamps.nothing(self.now())
        self._clock = WallClock() if self.simulated is None else None
        self.interventions = 0
        self.trouble = Trouble()
        self.bus_time = BusTime(bitrate)

    def _take_up(self, bus: can.BusABC) -> None:
        self._bus = bus
        self.simulated: SimulatedRig | None = bus if isinstance(bus, SimulatedRig) else None
        self.rig: Surroundings | None = self._around or self.simulated
        self.now: Callable[[], float] = self.simulated.now if self.simulated else time.monotonic

    @contextmanager
    def left(self, reopen: Callable[[], can.BusABC]) -> Iterator[None]:
        """Leave the bus for a while; what was received so far is dropped.

        Args:
            reopen: Opens it again.

        Raises:
            BenchError: It cannot be opened again.
        """
        self._bus.shutdown()
        try:
            yield
        finally:
            self._take_up(reopen())
            self._met_s = None
            self.forget()

    def use_bitrate(self, bitrate: int) -> None:
        """Send and receive at another bit rate from now on, in bit/s.

        Raises:
            BenchError: The adapter does not take it, and is at the former one again.
        """
        self.listen(SENT_WITHIN_S, lambda _: False)
        if self.simulated is not None:
            self.simulated.use_bitrate(bitrate)
        elif self._reopen is None:
            raise BenchError("the bit rate belongs to the interface and cannot be set here")
        else:
            self._bus.shutdown()
            try:
                self._bus = self._reopen(bitrate)
            except BenchError:
                self._bus = self._reopen(self.bus_time.bitrate)
                raise
            self._met_s = None
        self.bus_time.bitrate = bitrate

    @property
    def real_time(self) -> bool:
        """Time on the link's clock is time."""
        return self.simulated is None or self.simulated.real_time

    @property
    def time_s(self) -> float:
        """The present time on the clock of the timestamps, in seconds."""
        return self.now() + self._offset_s

    def send(self, frame: Frame) -> Stamped:
        """Send a frame.

        Raises:
            BenchError: The adapter refused it.
            NotAlone, NotNow: It concerns other units on the bus.
        """
        if self.others is not None:
            self.others.respect(frame)
            self._make_room(self.others.pause_s(self._duration_s(frame)))
        try:
            self._bus.send(to_message(frame))
        except (can.CanError, OSError) as error:
            raise BenchError(f"the adapter did not send {frame}: {first_line(error)}") from error
        now = self.now()
        self.bus_time.sent(frame, now)
        return self._keep(frame, now + self._offset_s, received=False)

    def _make_room(self, pause_s: float) -> None:
        """Leave the bus to others for as long as was asked for after the last frame."""
        if self.now() < self._free_s:
            while self.recv(self._free_s) is not None:
                pass
        self._free_s = self.now() + pause_s

    def recv(self, deadline: float) -> Stamped | None:
        """Wait for the next frame.

        Args:
            deadline: On the link's clock, in seconds.

        Returns:
            The frame, or None when the deadline has passed.

        Raises:
            BenchError: The adapter failed.
        """
        start_s = now_s = self.now()
        while True:
            remaining_s = max(0.0, deadline - now_s)
            message, now_s = self._take(remaining_s, now_s)
            if message is None:
                if remaining_s <= CLOCK_STEP_S or now_s >= deadline:
                    self.bus_time.awaited(start_s, deadline)
                    return None
                continue
            if message.is_error_frame:
                self.trouble.note(message)
            if message.is_error_frame or message.is_fd:
                continue
            stamped = self._received(message, now_s)
            end_s = stamped.time_s
            if self.simulated is None:
                end_s -= self._offset_s
            self.bus_time.received(stamped.frame, start_s, end_s)
            return stamped

    def _take(self, wait_s: float, now_s: float) -> tuple[can.Message | None, float]:
        """Return what the adapter has, waiting a while if need be, and when it was taken over.

        Raises:
            BenchError: The adapter failed, or the computer slept.
        """
        if self.stamps.by_host:
            wait_s = min(wait_s, SLICE_S)
        try:
            message = self._bus.recv(wait_s)
        except (can.CanError, OSError) as error:
            raise BenchError(f"the adapter stopped receiving: {first_line(error)}") from error
        if message is None:
            self.stamps.nothing(now_s + wait_s)
            self.trouble.look(self._bus)
        if self._clock is not None:
            self._clock.look()
        return message, self.now()

    def _received(self, message: can.Message, now_s: float) -> Stamped:
        time_s = message.timestamp
        if self.stamps.by_host:
            time_s = now_s + self._offset_s
        elif self.simulated is None:
            self._meet(message.timestamp, now_s)
        try:
            frame = to_frame(message)
        except WireError as error:
            raise BenchError(f"the adapter handed over what is no CAN frame: {error}") from error
        late_ms = self.stamps.late_ms(now_s, self._duration_s(frame))
        return self._keep(frame, time_s, received=True, late_ms=late_ms)

    def _meet(self, stamp_s: float, now_s: float) -> None:
        """Learn how far the clock of the timestamps is ahead, by the frame that was taken over least late.

        Args:
            stamp_s: Of a frame.
            now_s: When it was taken over.
        """
        ahead_s = stamp_s - now_s
        if self._met_s is not None:
            ahead_s = max(ahead_s, self._offset_s - DRIFT * (now_s - self._met_s))
        self._offset_s, self._met_s = ahead_s, now_s

    def _keep(
        self, frame: Frame, time_s: float, *, received: bool, late_ms: float = 0.0
    ) -> Stamped:
        if len(self._frames) >= MOST_KEPT:
            raise BenchError(f"{MOST_KEPT} frames within one check: something floods the bus")
        line = self._trace.add(time_s, frame, received=received)
        stamped = Stamped(frame, time_s, line, len(self._frames), received, late_ms)
        self._frames.append(stamped)
        return stamped

    def mark(self) -> int:
        """Return a point in the sequence of frames, for `since` and `wait`."""
        return len(self._frames)

    def since(self, mark: int, match: Match) -> list[Stamped]:
        """Return the frames received since a mark that match."""
        return [f for f in self._frames[mark:] if f.received and match(f.frame)]

    def sent(self, match: Match) -> list[Stamped]:
        """Return the frames that the bench sent since the last `forget` that match."""
        return [f for f in self._frames if not f.received and match(f.frame)]

    def wait(self, match: Match, timeout_s: float, mark: int | None = None) -> Stamped | None:
        """Return the first matching frame since a mark, waiting for it if need be.

        Args:
            match: What to wait for.
            timeout_s: Longest wait from now, in seconds.
            mark: Where to start; only what comes from now on when None.
        """
        return self.wait_until(match, self.now() + timeout_s, self.mark() if mark is None else mark)

    def wait_until(self, match: Match, deadline: float, mark: int) -> Stamped | None:
        """Return the first matching frame since a mark, waiting for it to a deadline if need be."""
        for stamped in self._frames[mark:]:
            if stamped.received and match(stamped.frame):
                return stamped
        while (received := self.recv(deadline)) is not None:
            if match(received.frame):
                return received
        return None

    def listen(self, duration_s: float, match: Match) -> list[Stamped]:
        """Receive for a while and return the frames that match."""
        mark = self.mark()
        deadline = self.now() + duration_s
        while self.recv(deadline) is not None:
            pass
        return self.since(mark, match)

    def collect(self, count: int, timeout_s: float, match: Match) -> list[Stamped]:
        """Receive until ``count`` matching frames came, or the time is over."""
        found: list[Stamped] = []
        deadline = self.now() + timeout_s
        while len(found) < count and (received := self.recv(deadline)) is not None:
            if match(received.frame):
                found.append(received)
        return found

    def drain(self) -> None:
        """Take in what has arrived, without waiting."""
        while self.recv(self.now()) is not None:
            pass

    def longest_wait_s(self, stamped: Stamped) -> float:
        """Return how long a received frame may have waited for the bus, at most.

        It may have waited while others were sent without a break, as long as it would have lost every
        arbitration: a frame of lower priority that began meanwhile shows that it was not there yet. One
        of the same node shows nothing, for a node may send its frames in their order.

        Args:
            stamped: Received since the last `forget`.
        """
        begin_s = earliest_s = stamped.time_s - self._duration_s(stamped.frame)
        node_id, rank = stamped.frame.can_id & _NODE_ID, priority(stamped.frame)
        own_s = 0.0
        for other in reversed(self._frames[: stamped.place]):
            if not other.received:
                own_s += self._duration_s(other.frame)
                continue
            if earliest_s - other.time_s > BREAK_S + own_s:
                break
            own_s = 0.0
            earliest_s = other.time_s - self._duration_s(other.frame)
            if priority(other.frame) > rank:
                if other.frame.can_id & _NODE_ID != node_id:
                    break
                rank = priority(other.frame)
        return begin_s - earliest_s

    def uncertainty_ms(self) -> float:
        """Return how far the time between two frames received since the last `forget` may be off, in ms."""
        return max((it.late_ms for it in self._frames if it.received), default=0.0)

    def _duration_s(self, frame: Frame) -> float:
        return bit_length(frame) / self.bus_time.bitrate

    def forget(self) -> None:
        """Drop the frames kept so far; the trace keeps them."""
        self._frames.clear()

    @property
    def line(self) -> int:
        """Lines of the trace so far."""
        return self._trace.lines

    def flush(self) -> None:
        """Hand the trace so far to the operating system."""
        self._trace.flush()

    def close(self) -> None:
        """Close the bus and the trace."""
        try:
            self._bus.shutdown()
        finally:
            self._trace.close()
