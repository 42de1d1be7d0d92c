"""One conformance run inside pytest: an item per requirement and case, verdicts into the record."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import ExitStack
from typing import Any

import pytest

from conformance.checks import BENCH, LATE_MS, PASSED, VERDICT
from conformance.effects import Effect
from conformance.errors import (
    BenchError,
    BenchLacks,
    HostLate,
    NodeTimeout,
    NotAlone,
    NotNow,
    SetupRefused,
    SpecError,
)
from conformance.interrupts import interruptible
from conformance.judged import item_id
from conformance.options import RunOptions
from conformance.report.plan import Planned
from conformance.report.results import Item
from conformance.requirements import Case, Requirement
from conformance.run import Run
from conformance.tries import Tries
from conformance.verdict import EmptyCheckError, Nonconformity, Unresolved, Verdict, VerdictWord

CHECK_TIMEOUT_S = 120
WAITING_TIMEOUT_S = 3600
"""For a check that waits for a person or a temperature, each time with a time limit of its own."""

_ABSENT = Case("", None, "")
RUN = pytest.StashKey[Run]()


def attach(config: pytest.Config) -> None:
    """Register the hooks of the run that the options ask for, or that is in the stash already."""
    if getattr(config.option, "numprocesses", None) or hasattr(config, "workerinput"):
        raise pytest.UsageError("one bus, one process: expected no -n beside --device")
    try:
        run = config.stash.get(RUN, None) or Run(RunOptions.from_pytest(config.option))
    except SpecError as error:
        raise pytest.UsageError(str(error)) from error
    if config.pluginmanager.hasplugin("timeout") and not config.option.timeout:
        waits = run.definition.waits_long
        config.option.timeout = WAITING_TIMEOUT_S if waits else CHECK_TIMEOUT_S
    config.pluginmanager.register(Tries(run), "conformance-tries")
    config.pluginmanager.register(ConformanceSession(config, run), "conformance-session")


class ConformanceSession:
    """The hooks of one run.

    Args:
        config: pytest's.
        run: What is run, and its record.
    """

    def __init__(self, config: pytest.Config, run: Run) -> None:
        self._config = config
        self._run = run
        self._signals = ExitStack()

    # One item per requirement and case

    @pytest.hookimpl(tryfirst=True)
    def pytest_pycollect_makeitem(self, obj: object) -> list[pytest.Item] | None:
        """Make nothing of a check of which the user wants no item."""
        requirement = getattr(obj, "requirement", None)
        if not isinstance(requirement, Requirement):
            return None
        cases = list(requirement.cases(self._run.spec)) or [_ABSENT]
        return None if any(self._run.selects(requirement, it) for it in cases) else []

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Make one item of each case a check applies to."""
        requirement: Requirement | None = getattr(metafunc.function, "requirement", None)
        if requirement is None:
            return
        found = list(requirement.cases(self._run.spec))
        prefix = f"{self._run.spec.name}/{requirement.id}"
        names = [f"{prefix}/{case.label}" for case in found] or [prefix]
        metafunc.fixturenames.append("_case")
        argument = [requirement.argument] if requirement.argument else []
        metafunc.parametrize(
            ["_case", *argument],
            [(case, *([case.subject] * len(argument))) for case in found or [_ABSENT]],
            ids=names,
        )

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Mark what does not apply or is not allowed here."""
        left = []
        for item in list(items):
            requirement, case = what(item)
            if requirement is None or case is None:
                continue
            if not self._run.selects(requirement, case):
                items.remove(item)
                left.append(item)
                continue
            effects = tuple(dict.fromkeys((*requirement.effects, *case.effects)))
            needs = tuple(dict.fromkeys((*requirement.needs, *case.needs)))
            if not case.label:
                item.add_marker(pytest.mark.skip(reason="not applicable: nothing in the spec"))
                continue
            reason = self._run.refuses(effects, needs)
            at_need = case.at_need if self._run.definition.allows(case.at_need) else ()
            if reason:
                item.add_marker(pytest.mark.skip(reason=reason))
            self._run.plan.append(Planned(requirement.id, effects, needs, at_need, reason))
        if left:
            self._config.hook.pytest_deselected(items=left)

    # The bench is open while the items run

    @pytest.hookimpl(wrapper=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Generator[None, object, object]:
        """Open the bench and find the node before the first item."""
        if session.config.option.collectonly or not session.items or session.testsfailed:
            return (yield)
        self._signals.enter_context(interruptible())
        try:
            count = sum(what(item)[0] is not None for item in session.items)
            self._config.stash[BENCH] = self._run.open(count, self._effects(session.items))
        except (BenchError, SpecError) as error:
            self._run.abort(str(error))
            session.items.clear()
        result = yield
        self._run.scan()
        return result

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Note where the item begins on the bus; skip it where it would wear the memory out too much."""
        requirement, case = what(item)
        if requirement is None or case is None or item.get_closest_marker("skip"):
            self._run.begin_item(runs=False)
            return
        reason = self._run.wears_out((*requirement.effects, *case.effects))
        self._run.begin_item(runs=not reason)
        if reason:
            pytest.skip(reason)

    @pytest.hookimpl(wrapper=True)
    def pytest_pyfunc_call(self, pyfuncitem: pytest.Function) -> Generator[None, object, object]:
        """Conclude the verdict when the check's function has ended."""
        self._run.begin_check()
        result = yield
        if what(pyfuncitem)[0] is None:
            return result
        pyfuncitem.stash.get(VERDICT, Verdict()).conclude()
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Turn what happened into a verdict, and stop the run when the rig or the node is gone."""
        report = yield
        error = call.excinfo.value if call.excinfo else None
        requirement, case = what(item)
        if requirement is None or case is None:
            return report
        if call.when == "call":
            item.stash[PASSED] = error is None
            item.stash[LATE_MS] = error.late_ms if isinstance(error, Unresolved | HostLate) else 0.0
        if call.when == "call" or (call.when == "setup" and error is not None):
            made = self._judge(item, requirement, case, error)
            self._run.record(made)
            if made.verdict == "fail" and made.level == "should" and not self._run.strict:
                report.outcome = "passed"
            if made.verdict in ("fail", "inconclusive"):
                report.longrepr = self._run.explain(made)
        if call.when == "teardown":
            self._run.reconsider()
            self._run.end_item()
        if isinstance(error, BenchError) or (
            call.when == "teardown" and isinstance(error, NodeTimeout)
        ):
            report.longrepr = str(error)
            self._run.abort(f"{error} (after {item_id(self._run.spec, requirement, case)})")
            item.session.shouldstop = str(error)
        return report

    def _effects(self, items: list[pytest.Item]) -> set[Effect]:
        """Return what those of some items may do to the node that are not skipped."""
        effects: set[Effect] = set()
        for item in items:
            requirement, case = what(item)
            if requirement is not None and case is not None and not item.get_closest_marker("skip"):
                effects.update(requirement.effects, case.effects)
                if self._run.definition.allows(case.at_need):
                    effects.update(case.at_need)
        return effects

    def _judge(
        self, item: pytest.Item, requirement: Requirement, case: Case, error: BaseException | None
    ) -> Item:
        word, reason = self._word(case, error)
        verdict = item.stash.get(VERDICT, Verdict())
        return self._run.item(requirement, case, word, verdict, reason)

    def _word(self, case: Case, error: BaseException | None) -> tuple[VerdictWord, str]:
        """Return the verdict that follows from how a check ended, with the reason."""
        word: VerdictWord = "inconclusive"
        reason = ""
        match error:
            case None:
                word = "pass"
            case Nonconformity() if self._run.trouble:
                reason = f"the adapter tells of {self._run.trouble}: check cable and termination"
            case Nonconformity():
                word = "fail"
            case pytest.skip.Exception() if not case.label:
                word, reason = "not_applicable", "the manual documents none"
            case pytest.skip.Exception():
                word, reason = "skipped", str(error.msg)
            case BenchLacks() | NotAlone():
                word, reason = "skipped", str(error)
            case SetupRefused() | NodeTimeout() | BenchError() | Unresolved() | NotNow():
                reason = str(error)
            case EmptyCheckError():
                reason = f"defect of the suite: {error}"
            case pytest.fail.Exception():
                reason = f"the check did not end within {CHECK_TIMEOUT_S} s"
            case _:
                reason = f"defect of the suite: {type(error).__name__}: {error}"
        return word, reason

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> Generator[None, object, object]:
        """Close the bench after what an interrupted check left was undone; exit with the verdict."""
        result = None
        try:
            result = yield
        except (BenchError, NodeTimeout) as error:
            self._run.abort(str(error))
        if self._run.opened:
            self._run.close()
        self._signals.close()
        if self._run.opened or self._run.results.aborted:
            session.exitstatus = self._run.results.exit_code
        return result

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Say where the record is."""
        if self._run.results.aborted:
            terminalreporter.write_line(f"the run ended early: {self._run.results.aborted}")
        if self._run.opened:
            terminalreporter.write_line(f"conformance record: {self._run.directory}")

    def pytest_internalerror(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """Let no run conform that a defect of the suite ended."""
        self._run.abort(f"defect of the suite: {excinfo.typename}: {excinfo.value}")

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """Keep what was judged so far."""
        if excinfo.type is KeyboardInterrupt:  # not pytest's own, which stops a session
            self._run.abort("interrupted by the user")


def what(item: pytest.Item) -> tuple[Requirement | None, Case | None]:
    """Return what an item is about."""
    requirement = getattr(getattr(item, "function", None), "requirement", None)
    callspec = getattr(item, "callspec", None)
    return requirement, callspec.params.get("_case") if callspec else None
