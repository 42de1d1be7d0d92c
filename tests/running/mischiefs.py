"""Every kind of mischief, by its name."""

from __future__ import annotations

from meddled_blocks import BlockTransfers
from meddled_nodes import (
    AnswersElsewhere,
    Dies,
    FallsSilent,
    Floods,
    ForeignTraffic,
    ForgesItsOwn,
    LssLies,
    Restarts,
    SameNodeId,
)
from meddled_uploads import EndlessUploads, NastyTexts, Uploads
from meddling import (
    Aborts,
    ChangesLength,
    Delays,
    Doubles,
    Drops,
    FlipsBits,
    Garbage,
    Mischief,
    Reorders,
    RightLookingGarbage,
    SpoilsRequests,
    SwapsIdentifiers,
    TruncatesSegments,
)

MISCHIEFS: dict[str, type[Mischief]] = {
    it.__name__: it
    for it in (
        FlipsBits,
        ChangesLength,
        Drops,
        Doubles,
        Delays,
        Reorders,
        SwapsIdentifiers,
        Aborts,
        Garbage,
        RightLookingGarbage,
        Uploads,
        EndlessUploads,
        NastyTexts,
        TruncatesSegments,
        FallsSilent,
        SpoilsRequests,
        Floods,
        ForeignTraffic,
        ForgesItsOwn,
        BlockTransfers,
        AnswersElsewhere,
        SameNodeId,
        Dies,
        Restarts,
        LssLies,
    )
}
