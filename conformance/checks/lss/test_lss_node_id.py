"""LSS configures the node-ID: what it takes, when it acts, what is kept (CiA 305 v3.0, 6.4 and 6.5)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.reach import Place
from conformance.bench.services.lss import LssPort
from conformance.bench.services.lss_master import DONE
from conformance.checks.lss.lss_cases import (
    CIA305,
    OUT_OF_RANGE,
    Acts,
    acts,
    ever,
    judge_acts,
    node_ids,
    once,
    show_outcome,
)
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtCommand

NODE_ID = f"{CIA305}, 6.4"
BIT_TIMING = f"{CIA305}, 6.4"
STORE = f"{CIA305}, 6.5"
ILLEGAL_NODE_IDS = (0, 128, 200, 254)
"""Node-IDs that no edition of CiA 305 allows; 255 stands for none in some."""


def _legal(spec: DeviceSpec) -> Iterable[Case]:
    for source in ever(spec, "configure-node-id", "configuration"):
        for node_id in node_ids(spec):
            yield Case(f"11h/{node_id}", node_id, source)


@requirement(
    "LSS-13",
    level="manual",
    cases=("node_id", _legal),
    source=NODE_ID,
    effects=("reads", "node-id", "resets"),
)
def test_node_id_is_configured(lss: LssPort, node_id: int, verdict: Verdict) -> None:
    """A node-ID that the manual allows is configured, error code 0."""
    lss.enter()
    lss.configure()

    answer = lss.node_id(node_id)

    verdict.equal(f"answer to node-ID {node_id}", answer.error_code, DONE, show=show_outcome)


def _illegal(spec: DeviceSpec) -> Iterable[Case]:
    for source in ever(spec, "configure-node-id", "configuration"):
        for node_id in ILLEGAL_NODE_IDS:
            yield Case(f"11h/{node_id}", node_id, source)


@requirement(
    "LSS-14",
    level="shall",
    cases=("node_id", _illegal),
    source=NODE_ID,
    effects=("reads", "node-id", "resets"),
)
def test_illegal_node_id_is_refused(lss: LssPort, node_id: int, verdict: Verdict) -> None:
    """A node-ID out of range is answered with error code 1."""
    lss.enter()
    lss.configure()

    answer = lss.node_id(node_id)

    verdict.equal(
        f"answer to node-ID {node_id}", answer.error_code, OUT_OF_RANGE, show=show_outcome
    )


@requirement(
    "LSS-15",
    level="shall",
    cases=once("11h", "configure-node-id"),
    source=NODE_ID,
    effects=("reads", "node-id", "resets"),
)
def test_node_id_acts_after_a_reset(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """A configured node-ID acts at the next NMT reset communication, and not before."""
    home, away = _configure_away(lss)
    lss.wait()
    lss.settle()

    before = lss.locate(home, away)
    verdict.equal("place before the reset", str(before), str(home))
    after = lss.reach.reset(lss.node, away, home, command=NmtCommand.RESET_COMMUNICATION)

    acted: Acts = "configured" if after == away else "stored"
    judge_acts(verdict, spec, acted, {"configured": away, "stored": home}, after)
    if after is not None:
        left = home if after == away else away
        verdict.equal("another node-ID answers", lss.answers_at(left.node_id), False)


def _configure_away(lss: LssPort) -> tuple[Place, Place]:
    """Configure a free node-ID; return where the node is, and where it is to be."""
    home = lss.reach.home
    away = Place(lss.free_node_id(), home.bitrate)
    lss.enter()
    lss.configure()
    lss.prepared("a node-ID", lss.node_id(away.node_id), "LSS-13")
    return home, away


@requirement(
    "LSS-16",
    level="manual",
    cases=once("17h/node-id", "configure-node-id", "store-configuration"),
    source=STORE,
    effects=("reads", "node-id", "resets", "non-volatile", "power"),
)
def test_stored_node_id_is_kept(lss: LssPort, verdict: Verdict) -> None:
    """A node-ID that was stored is the node's after the supply was switched off and on."""
    lss.begin()
    home, away = _configure_away(lss)
    lss.prepared("the store", lss.store(), "LSS-18")
    lss.wait()

    after = lss.reach.power_cycle(lss.node, away, home)

    verdict.equal("place after power-on", str(after), str(away))


@requirement(
    "LSS-17",
    level="shall",
    cases=once("11h", "configure-node-id", "store-configuration"),
    source=STORE,
    effects=("reads", "node-id", "resets", "power"),
)
def test_unstored_node_id_is_lost(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """A node-ID that was not stored is gone after the supply was switched off and on."""
    home, away = _configure_away(lss)
    lss.wait()
    seen = lss.reach.reset(lss.node, away, home, command=NmtCommand.RESET_COMMUNICATION)
    if seen != away and "stored" not in acts(spec):
        raise SetupRefused("the node does not take the node-ID configured, see LSS-15")

    after = lss.reach.power_cycle(lss.node, home, away)

    verdict.equal("place after power-on", str(after), str(home))


@requirement(
    "LSS-18",
    level="manual",
    cases=once("17h", "store-configuration"),
    source=STORE,
    effects=("reads", "resets", "non-volatile"),
)
def test_store_is_confirmed(lss: LssPort, verdict: Verdict) -> None:
    """A store is answered with error code 0."""
    lss.begin()
    lss.enter()
    lss.configure()

    answer = lss.store()

    verdict.equal("answer to a store", answer.error_code, DONE, show=show_outcome)
