"""What several test modules share, and the table of cases that `make fuzz` and `make faults` end with."""

import functools
import os
from collections.abc import Callable, Generator, Iterator
from typing import Any

import pytest

if "PYTEST_XDIST_WORKER" in os.environ:  # a worker has one core: threads of two workers wait for each other
    os.environ.setdefault("OMP_NUM_THREADS", "1")

_HARD = ("tests/test_fuzz_", "tests/test_faults_", "tests/test_checkpoint")


@pytest.fixture(scope="module")
def private_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A user's cache folder of the module's own, empty at first."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trainings without pictures and recording, which take longer than a tiny training."""
    without_pictures(monkeypatch)


def without_pictures(patch: pytest.MonkeyPatch) -> None:
    """For a fixture of a module's own."""
    for what in ("figures.draw_learning", "figures.draw_policy", "stages.record_stages"):
        patch.setattr(f"orient_eye.learning.{what}", lambda *_: None)


@pytest.fixture
def short_second_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """By half of its generations, after which it gains 0.3 % of the reward at most on the saccades of these tests."""
    from orient_eye.search import second_search

    for name, limit, most in (("differential_evolution", "maxiter", 180), ("minimize", "maxfev", 400)):
        monkeypatch.setattr(second_search, name, functools.partial(_limited, getattr(second_search, name), limit, most))


def _limited(search: Callable[..., Any], limit: str, most: int, *args: Any, **options: Any) -> Any:
    """A search of scipy, its limit lowered where it stands: among its options or theirs."""
    holder = options if limit in options else options["options"]
    holder[limit] = min(holder[limit], most)
    return search(*args, **options)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first, so that no worker is still at one when the others are done."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """Count the examples of hypothesis that held; a test that tries many cases itself records the property "cases"."""
    hypothesis = getattr(getattr(item, "obj", None), "hypothesis", None)
    if hypothesis is None:
        return (yield)
    test, held = hypothesis.inner_test, 0

    @functools.wraps(test)
    def counted(*args: Any, **kwargs: Any) -> None:
        nonlocal held
        test(*args, **kwargs)
        held += 1

    hypothesis.inner_test = counted
    try:
        return (yield)
    finally:
        hypothesis.inner_test = test
        item.user_properties.append(("cases", held))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Cases tried and failures of each test that tries to break something: a line in the suite, a table on demand."""
    table: dict[str, list[int]] = {}
    for reports in terminalreporter.stats.values():
        for report in reports:
            if not (isinstance(report, pytest.TestReport) and report.nodeid.startswith(_HARD)):
                continue
            if report.failed or (report.when == "call" and report.passed):
                held = dict(report.user_properties).get("cases", int(report.passed))
                row = table.setdefault(report.nodeid.split("[")[0], [0, 0])
                row[0] += int(str(held)) + report.failed
                row[1] += report.failed
    if not table:
        return
    terminalreporter.section("what was tried to break it", sep="-")
    if {"FUZZ_EXAMPLES", "FAULTS"} & set(os.environ):
        for name, (tried, failures) in sorted(table.items()):
            terminalreporter.line(f"{tried:8,} cases, {failures} failures  {name}")
    tried, failures = (sum(column) for column in zip(*table.values(), strict=True))
    terminalreporter.line(f"{tried:8,} cases tried, {failures} failures")
