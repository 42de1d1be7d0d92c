"""The node's sensor fusion tried in place of its low-pass filter: how the values follow a sudden turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.sensor.filters import (
    Angles,
    Choice,
    Responses,
    moments,
    put_in_force,
    require_held,
    respond,
    written,
)
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.settings import Settings
from conformance.spec.behaviours import Fusion, LowPassFilter
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Key


@dataclass(frozen=True, slots=True)
class Fused:
    """What became of a sensor fusion.

    Args:
        answer: To the download that chose it.
        chosen: Its object holds the value that chose it, once that was to be in force.
        responses: By the value of its settings in words; none where it was refused.
    """

    answer: Transfer
    chosen: bool
    responses: Mapping[str, Responses]


def observe_fusion(
    node: Node,
    stimulus: Stimulus,
    rules: list[LowPassFilter],
    slow: Choice,
    before: Angles,
    after: Angles,
) -> Fused:
    """Turn the node with the fusion in place of a slow filter; the node is left with what it had stored.

    Args:
        node: The node under test.
        stimulus: What turns it.
        rules: The filters of all axes, which one fusion takes the place of.
        slow: The filter that is chosen, slow enough to be told.
        before: The tilt of both axes from which it is turned, in deg.
        after: The tilt to which it is turned.
    """
    rule, fusion = rules[0], rules[0].fusion
    if fusion is None:
        raise TypeError("no fusion")
    keys = [key_of(it.value) for it in rules]
    when = moments(node.spec, rule)
    chosen = node.spec.entries[key_of(fusion.object)]
    data = chosen.type.encode(fusion.value)
    settings = Settings(node)
    responses: dict[str, Responses] = {}
    try:
        settings.begin()
        answer = node.write(*chosen.key, data)
        for name, parameters in _parameters(node.spec, fusion) if answer.confirmed else ():
            wanted = dict(written(node.spec, rule, slow)) | {chosen.key: data} | parameters
            lost = put_in_force(node, settings, wanted, when)
            if chosen.key in lost:
                return Fused(answer, chosen=False, responses={})
            require_held(node, lost)
            responses[name] = respond(node, stimulus, keys, before, after)
        return Fused(answer, chosen=True, responses=responses)
    finally:
        settings.put_back()


def _parameters(spec: DeviceSpec, fusion: Fusion) -> Iterator[tuple[str, dict[Key, bytes]]]:
    """Return each value of its settings to try, in words and to be written."""
    for place, values in fusion.parameters.items():
        entry = spec.entries[key_of(place)]
        for value in values:
            yield f"{entry.address} = {value}", {entry.key: entry.type.encode(value)}
    if not fusion.parameters:
        yield "fusion", {}
