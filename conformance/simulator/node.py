"""What the services of one node share: identity, object dictionary, time, faults and the way out."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

from conformance.simulator.agenda import Agenda
from conformance.simulator.dictionary import ObjectDictionary
from conformance.simulator.faults import Faults
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtState


@dataclass(slots=True)
class Node:
    """One node between two resets.

    Args:
        node_id: 1..127.
        dictionary: The object dictionary.
        agenda: Timers and the present time.
        faults: Defects to show.
        send: Hands a frame to the CAN controller.
        random: Source of everything random, seeded.
        state: NMT state; BOOT_UP until the initialisation has ended.
    """

    node_id: int
    dictionary: ObjectDictionary
    agenda: Agenda
    faults: Faults
    send: Callable[[Frame], None]
    random: random.Random
    state: NmtState = NmtState.BOOT_UP
