"""How long hypothesis looks for a bad input: a moment in the suite, much longer by `make fuzz` (FUZZ_EXAMPLES)."""

import os

from hypothesis import HealthCheck, settings

_EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "0"))


def budget(default: int) -> settings:
    """Settings of a test: `default` examples, always the same ones, or FUZZ_EXAMPLES new ones where that is set.

    Fixtures of a test's scope may be shared by its examples, so an example leaves them as they were.
    """
    return settings(
        max_examples=_EXAMPLES or default,
        derandomize=not _EXAMPLES,
        database=None,
        deadline=None,
        print_blob=True,
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )
