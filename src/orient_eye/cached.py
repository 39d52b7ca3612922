"""`functools.cached_property` as it is from Python 3.12 on: without a lock.

Before, all instances share one: threads wait for one another, and a child that was forked while another thread computed
waits for ever. Computed twice at once, a property of ours has the same value twice.
"""

import functools
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from functools import cached_property
else:

    class cached_property(functools.cached_property):
        """A property that is computed once and then kept."""

        def __get__(self, instance: Any, owner: Any = None) -> Any:
            if instance is None:
                return self
            if self.attrname not in instance.__dict__:
                instance.__dict__[self.attrname] = self.func(instance)
            return instance.__dict__[self.attrname]


__all__ = ["cached_property"]
