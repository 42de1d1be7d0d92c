"""What a check may do to a node, and what it needs beside a bus, so that a bench can say what it has."""

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

WEARING: frozenset[Effect] = frozenset({"non-volatile", "restores", "node-id", "bitrate"})
"""Effects that come with writes of the non-volatile memory."""

IN_FORCE: tuple[Effect, ...] = ("resets", "non-volatile")
"""What it takes to put values in force that act only after a store and a restart."""

Need: TypeAlias = Literal[
    "tilt",
    "sudden-tilt",
    "temperature",
    "supply",
    "operator",
    "second-node",
    "bus-errors",
    "remote-frames",
]
"""Beside data frames: the stimulus of a quantity, a person who looks, another node of the same kind."""

LACKING: dict[Need, str] = {
    "tilt": "the bench has no tilt stimulus",
    "sudden-tilt": "the bench cannot tilt at once",
    "temperature": "the bench cannot change the temperature",
    "supply": "the bench cannot change the supply voltage",
    "operator": "the bench has no operator",
    "second-node": "the bench has no second node of this kind",
    "bus-errors": "the bench cannot disturb the bus",
    "remote-frames": "the interface carries no remote frames",
}
