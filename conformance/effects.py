"""What a check may do to a node, so that a bench can say what it allows."""

from __future__ import annotations

from typing import Literal, TypeAlias

Effect: TypeAlias = Literal[
    "reads",
    "writes",
    "resets",
    "restores",
    "power",
    "non-volatile",
    "node-id",
    "bitrate",
    "other-nodes",
]
