"""What a bench leaves to the other units on its bus: their node-IDs, their turn, their share."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from conformance.errors import NotAlone, NotNow
from conformance.wire import cob_id
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.sdo import BlockDownloadInitiate, InitiateDownload, decode_request

FULL: Final = 0.7
"""Share of a bus that SDO transfers with all units may take together: with more, the lowest priority starves."""

_NODE_ID: Final = 0x7F
_OF_A_NODE: Final = range(0x200, 0x780)
_SDO_REQUESTS: Final = range(0x601, 0x680)
_NOT_VALID: Final = 1 << 31
_TO_ALL: Final = (cob_id.SYNC, cob_id.TIME)


class OtherUnits:
    """The other units on the bus.

    Args:
        node_ids: Theirs.
        cob_ids: Index and sub-index of the objects with COB-IDs of the unit under test.
        judged: They are being judged meanwhile.
    """

    def __init__(
        self, node_ids: Collection[int], cob_ids: Collection[tuple[int, int]], *, judged: bool
    ) -> None:
        self._node_ids = frozenset(node_ids)
        self._cob_ids = frozenset(cob_ids)
        self.judged = judged

    def respect(self, frame: Frame) -> None:
        """Make sure that a frame touches none of them.

        Raises:
            NotAlone: It concerns them, whenever it is sent.
            NotNow: It concerns them while they are being judged.
        """
        can_id, data = frame.can_id, frame.data
        if can_id == cob_id.NMT:
            addressed = data[1] if len(data) > 1 else 0
            concerned = addressed == 0 or addressed in self._node_ids
        else:
            concerned = can_id in _OF_A_NODE and can_id & _NODE_ID in self._node_ids
        if concerned or can_id == cob_id.LSS_MASTER:
            raise NotAlone("other units on the bus would take it for theirs")
        if self.judged and (can_id in _TO_ALL or self._moves(frame)):
            raise NotNow("other units on the bus are being judged")

    def pause_s(self, duration_s: float) -> float:
        """Return how long to wait after a request, so that all units together leave room on the bus.

        Args:
            duration_s: Of the request; its response takes about as long.
        """
        if not self.judged:
            return 0.0
        return 2 * duration_s * (len(self._node_ids) + 1) / FULL

    def _moves(self, frame: Frame) -> bool:
        """Tell whether a request has the unit send with an identifier that others may use as well."""
        if frame.can_id not in _SDO_REQUESTS:
            return False
        try:
            request = decode_request(frame.data)
        except WireError:
            return False
        if not isinstance(request, InitiateDownload | BlockDownloadInitiate):
            return False
        if (request.index, request.sub) not in self._cob_ids:
            return False
        data = request.data if isinstance(request, InitiateDownload) else None
        if data is None:
            return True  # it comes in segments
        word = int.from_bytes(data, "little")
        return not word & _NOT_VALID and word & _NODE_ID != frame.can_id & _NODE_ID
