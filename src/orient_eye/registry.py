"""Things chosen by name: ours, and those that other people's packages add.

    PULSES: Registry[Pulse] = Registry("pulse", {"1": VARIANT_1})
    PULSES["1"]; PULSES.register("mine", pulse); list(PULSES)

An entry is the thing itself, or where it is as "module:attribute", loaded when it is first asked for, so
that names can be listed without loading what is behind them. An installed package adds entries by Python's
entry points, in the group `orient_eye.` + the registry's name in the plural:

    [project.entry-points."orient_eye.pulses"]
    mine = "my_package:MY_PULSE"
"""

import importlib
from collections.abc import Iterator, Mapping
from importlib import metadata
from typing import Any, Generic, TypeVar, cast

from orient_eye.cached import cached_property
from orient_eye.errors import InputError

T = TypeVar("T")


def load(place: str) -> Any:
    """The thing at "module:attribute"."""
    module, _, attribute = place.partition(":")
    return getattr(importlib.import_module(module), attribute)


class Registry(Mapping[str, T], Generic[T]):
    """Names and what they stand for, in the order they were added.

    Args:
        what: the kind of thing, in the singular: for messages and for the group of entry points.
        entries: ours: the thing, or "module:attribute". A name that another package adds too stays ours.
        kind: class of the things; None for any.
    """

    def __init__(self, what: str, entries: Mapping[str, T | str], kind: type | None = None) -> None:
        self.what, self.kind = what, kind
        self._own: dict[str, T | str] = dict(entries)
        self._loaded: dict[str, T] = {}

    @cached_property
    def _added(self) -> dict[str, metadata.EntryPoint]:
        return {point.name: point for point in metadata.entry_points(group=f"orient_eye.{self.what}s")}

    def __getitem__(self, name: str) -> T:
        """What the name stands for.

        Raises:
            InputError: unknown, or another package's that cannot be loaded.
        """
        if name in self._loaded:
            return self._loaded[name]
        if name in self._own:
            entry, package = self._own[name], "orient-eye"
        elif name in self._added:
            point = self._added[name]
            entry, package = point.value, point.dist.name if point.dist else point.module
        else:
            raise InputError(f"unknown {self.what} {name!r}; choose one of {', '.join(self)}")
        try:
            found = load(entry) if isinstance(entry, str) else entry
        except Exception as error:  # importing it runs another package's code, which may raise anything
            raise InputError(f"{self.what} {name!r} of package {package} cannot be loaded: {error}") from error
        if self.kind is not None and not isinstance(found, self.kind):
            got, wanted = type(found).__name__, self.kind.__name__
            raise InputError(f"{self.what} {name!r} of package {package} is a {got}; it must be a {wanted}")
        self._loaded[name] = cast(T, found)
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._own, *self._added)))

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._added

    def register(self, name: str, entry: T) -> None:
        """Add an entry for this process.

        Raises:
            InputError: the name is taken.
        """
        if name in self:
            raise InputError(f"there is a {self.what} {name!r} already; choose another name")
        self._own[name] = entry
