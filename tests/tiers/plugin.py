"""Choose the tests of a tier, and run those that are marked `interpreted` without a compiler.

The default tier leaves out tests that are marked `exhaustive`, and hands those that are marked `interpreted` to a
process in which the compiler is `python` (`child.py`). A law takes fewer steps to show than its kernels take seconds to
compile. `--exhaustive` runs every test, compiled.
"""

from __future__ import annotations

import os
from collections import defaultdict

import pytest

from physics.compiler.compiler_choice import VARIABLE
from tests.tiers.child import Child

MARKS = (
    "exhaustive: a sweep, a long run or a combination; left out without --exhaustive",
    "interpreted: runs under the compiler `python` without --exhaustive, since its kernels take longer to compile",
    "compiled: runs compiled in every tier, in a module that is interpreted",
)


def add_options(parser) -> None:
    """Add the option of the tiers."""
    parser.addoption("--exhaustive", action="store_true", help="run every test, compiled; without it the default tier")


def configure(config) -> None:
    """Declare the marks, and take tests of the default tier over."""
    for line in MARKS:
        config.addinivalue_line("markers", line)
    if not config.getoption("--exhaustive"):
        config.pluginmanager.register(_LeaveOut())
        # A compiler that the user has chosen runs all tests, and a debugger needs them in this process.
        if VARIABLE not in os.environ and not config.getoption("usepdb"):
            config.pluginmanager.register(_Interpret(config))


class _LeaveOut:
    """Deselect tests of the other tier."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, config, items):
        left_out = [item for item in items if item.get_closest_marker("exhaustive")]
        if left_out:
            config.hook.pytest_deselected(items=left_out)
            items[:] = [item for item in items if not item.get_closest_marker("exhaustive")]


class _Interpret:
    """Run marked tests in a child, which is started once, and report them here."""

    def __init__(self, config):
        self._config, self._child, self._asked = config, None, None
        self._reports: dict[str, list] = defaultdict(list)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        if not _is_interpreted(item):
            return None
        item.is_relayed = True
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for report in self._reports_of(item):
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        item.session._setupstate.teardown_exact(nextitem)  # fixtures that the test before it left for it
        return True

    @pytest.hookimpl(optionalhook=True)
    def pytest_timeout_set_timer(self, item):
        """Leave the time-out of a test to the process that runs it."""
        return True if _is_interpreted(item) else None

    def pytest_sessionfinish(self):
        if self._child is not None:
            self._child.end()

    def _reports_of(self, item) -> list:
        """Return the reports of a test; its module runs as a whole, as its fixtures are shared."""
        if self._asked != item.path and item.nodeid not in self._reports:
            self._ask(item)
        while self._child is not None and not _is_over(self._reports[item.nodeid]):
            report = self._child.read()
            if report is None:  # it has ended with the test
                self._child, self._asked = None, None
                return [*self._reports[item.nodeid], _lost(item)]
            made = self._config.hook.pytest_report_from_serializable(config=self._config, data=report)
            if isinstance(made.longrepr, list):  # a tuple of a skipped test, which JSON does not know
                made.longrepr = tuple(made.longrepr)
            self._reports[made.nodeid].append(made)
        return self._reports[item.nodeid]

    def _ask(self, item) -> None:
        if self._child is None:
            self._child = Child(self._config.rootpath)
        others = [each.nodeid for each in item.session.items
                  if each.path == item.path and _is_interpreted(each)]  # fmt: skip
        waiting = others[others.index(item.nodeid) :]
        self._child.ask(str(item.path), waiting, self._config.getoption("--costs", None))
        self._asked = item.path


def _is_interpreted(item) -> bool:
    """Answer whether a test needs no compiler: a test of a module that is marked may ask for one."""
    return bool(item.get_closest_marker("interpreted")) and not item.get_closest_marker("compiled")


def _is_over(reports: list) -> bool:
    """Answer whether the last stage of a test is among its reports."""
    return any(report.when == "teardown" for report in reports)


def _lost(item) -> pytest.TestReport:
    """Report a test whose process has ended."""
    message = "the process of interpreted tests has ended during this test"
    return pytest.TestReport(item.nodeid, item.location, {}, "failed", message, "call")
