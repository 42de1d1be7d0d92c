"""EMCY by event: once for an error, at its end, with several errors (CiA 301 v4.2.0, 7.2.7.1)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

from conformance.bench.node.node import Node
from conformance.bench.services.emcy import EmcyPort, decoded
from conformance.bench.services.provocations import AnyProvocation, BusProvocation, Provocation
from conformance.checks.errors.emcies import (
    NO_ERROR,
    any_errors,
    both_sides,
    came_about,
    code_words,
    errors,
    judge,
    pairs,
    register_word,
    tilted_with_register,
    told,
    unlimited,
)
from conformance.checks.steps import require_alive
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict

USAGE = f"{CIA301}, 7.2.7.1"
REGISTER = f"{CIA301}, 7.5.2.2"
STAYS_S = 1.0


@requirement(
    "EMCY-08",
    level="shall",
    cases=("error", errors),
    source=USAGE,
    effects=("reads", "writes"),
    needs=("sudden-tilt",),
)
def test_error_is_told_once(
    spec: DeviceSpec, emcy: EmcyPort, error: Provocation, verdict: Verdict
) -> None:
    """An error is told by one EMCY, and by no other while it lasts."""
    messages = told(spec, emcy, error, verdict)
    if messages is None:
        return

    later = emcy.listen(STAYS_S)

    verdict.equal("EMCYs when the error came", len(messages), 1)
    verdict.equal("EMCYs while it lasted", len(later), 0)


@requirement(
    "EMCY-26",
    level="manual",
    cases=("error", both_sides),
    source=USAGE,
    effects=("reads", "writes"),
    needs=("sudden-tilt",),
)
def test_angle_within_its_limits_is_no_error(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: Provocation, verdict: Verdict
) -> None:
    """An angle near its limit, and within it, is no error."""
    emcy.calm()

    seen = emcy.tilt({error.axis: error.within_deg})

    told_codes = [decoded(one).error_code for one in seen]
    register = emcy.register()
    if not (seen or register) or not unlimited(spec, error, verdict, code_words(told_codes)):
        at = f"at {error.within_deg:g} deg"
        verdict.equal(f"error codes {at}", told_codes, [], show=code_words)
        verdict.equal(f"error register {at}", register, 0, show=register_word)
    require_alive(node)


@requirement(
    "EMCY-09",
    level="shall",
    cases=("error", errors),
    source=USAGE,
    effects=("reads", "writes"),
    needs=("sudden-tilt",),
)
def test_end_of_an_error_is_told(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: Provocation, verdict: Verdict
) -> None:
    """The end of the last error is told by one EMCY with code 0000h and register 0."""
    if told(spec, emcy, error, verdict) is None:
        return

    seen = [decoded(one) for one in emcy.relieve()]

    lasting = emcy.present()
    judge(
        spec,
        verdict,
        "codes when the error went",
        tuple(message.error_code for message in seen),
        lambda producer: {_told_at_the_end(producer, lasting=lasting)},
        show=code_words,
    )
    registers = sorted({message.error_register for message in seen} - {0})
    verdict.equal("error registers other than 0", registers, [])
    require_alive(node)


def _told_at_the_end(producer: EmcyProducer, *, lasting: bool) -> tuple[int, ...]:
    """Return the error codes at the end of an angle's error, by what the manual says."""
    silent = producer.cleared == "silent" or (producer.lasts == "until-reset" and lasting)
    return () if silent else (NO_ERROR,)


def _of_the_bus(spec: DeviceSpec) -> Iterable[Case]:
    return (case for case in any_errors(spec) if isinstance(case.subject, BusProvocation))


@requirement("EMCY-33", level="manual", cases=("error", _of_the_bus), effects=("reads", "writes"))
def test_no_error_is_told_by_zeros(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """Once the error of the bus is gone an EMCY of zeros alone says so, where one is documented."""
    if told(spec, emcy, error, verdict) is None:
        return

    seen = [decoded(one) for one in emcy.relieve()]

    ends = [message for message in seen if message.error_code == NO_ERROR]
    for message in ends:
        rest = bytes((message.error_register,)) + message.manufacturer
        verdict.equal("octets 2 to 7 with code 0000h", rest.hex(), bytes(len(rest)).hex())
    if emcy.present():
        verdict.equal("codes 0000h while the error lasts", len(ends), 0)
        return
    judge(
        spec,
        verdict,
        "codes when the error went",
        tuple(message.error_code for message in ends[:1]),
        lambda producer: {(NO_ERROR,) if producer.cleared == "sent" else ()},
        show=code_words,
    )


@requirement(
    "EMCY-10",
    level="shall",
    cases=("error", tilted_with_register),
    source=REGISTER,
    effects=("reads", "writes"),
    needs=("sudden-tilt",),
)
def test_register_returns_to_zero(
    spec: DeviceSpec, emcy: EmcyPort, error: Provocation, verdict: Verdict
) -> None:
    """The error register is 0 again when the error has gone."""
    if told(spec, emcy, error, verdict) is None:
        return
    emcy.relieve()

    register = emcy.register()

    judge(
        spec,
        verdict,
        "error register",
        register,
        lambda producer: {0} if producer.lasts == "while-present" else {0, register},
        show=register_word,
    )


@requirement(
    "EMCY-11",
    level="manual",
    cases=("both", pairs),
    source=USAGE,
    effects=("reads", "writes"),
    needs=("sudden-tilt",),
)
def test_two_errors_are_told_as_documented(
    spec: DeviceSpec, emcy: EmcyPort, both: tuple[Provocation, Provocation], verdict: Verdict
) -> None:
    """A second error, the end of one and the end of both are told as documented."""
    steps = ((both[0],), both, (both[1],), ())
    emcy.calm()
    seen = [emcy.provoke(*present) for present in steps[:1]]
    if not came_about(spec, emcy, both[0], seen[0], verdict):
        return

    seen += [emcy.provoke(*present) for present in steps[1:]]

    codes = tuple(tuple(decoded(one).error_code for one in step) for step in seen)
    allowed = {_told_at(producer, steps) for producer in _combined(spec)}
    judge(
        spec,
        verdict,
        "codes at each change",
        codes,
        lambda producer: {_told_at(producer, steps)} | ({codes} & allowed),
        show=lambda told_codes: "; ".join(map(code_words, told_codes)),
    )
    if emcy.producer.register_bits and seen[2]:
        register = decoded(seen[2][-1]).error_register
        verdict.holds(
            "error register while the second error lasts",
            expected="not 00h",
            actual=register_word(register),
            ok=register != 0,
        )


def _combined(spec: DeviceSpec) -> Iterable[EmcyProducer]:
    """Return the producer under every combination of readings that bears on what it tells."""
    readings = [it.emcy_producer for it, _ in spec.services_readings if it.emcy_producer]
    rules = product(
        {it.sends for it in readings},
        {it.cleared for it in readings},
        {it.lasts for it in readings},
    )
    for sends, cleared, lasts in rules:
        for producer in readings:
            update = {"sends": sends, "cleared": cleared, "lasts": lasts}
            yield producer.model_copy(update=update)


def _told_at(
    producer: EmcyProducer, steps: Iterable[tuple[Provocation, ...]]
) -> tuple[tuple[int, ...], ...]:
    """Return the error codes at each step, by what the manual says of the producer."""
    causes = {cause.cause: (cause.code, cause.bit) for cause in producer.causes}
    before: set[tuple[int, int | None]] = set()
    codes = []
    for step in steps:
        present = {causes[error.axis] for error in step}
        present |= before if producer.lasts == "until-reset" else set()
        new, gone = present - before, before - present
        each = producer.sends == "each-change"
        come = tuple(code for code, _ in new) if each or not before else ()
        ended = gone and (each or not present) and producer.cleared == "sent"
        codes.append((*come, *((NO_ERROR,) if ended else ())))
        before = present
    return tuple(codes)
