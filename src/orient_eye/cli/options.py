"""Options that come from the registries, so that whatever is registered is offered, and its own options too.

A field of a command named `plant`, `case`, `targets`, `pulse` or `engine` takes the names of that registry. A field
`plant_options` becomes the union of all plants' own options; what is given of them is its value.

    command = parse(Simulate, ["--motor", "x.csv", "--plant", "mujoco", "--accurate"], program="orient-eye simulate")
    command.plant_options                            # {"accurate": True}

A field that is annotated with `Several(config)` takes the options of that dataclass, each with several values; what is
given of them is its value, by name: {"case": ("1", "2-fixed"), "seed": (0, 1, 2)}.
"""

import inspect
import operator
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import Field, dataclass, field, fields, is_dataclass, make_dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import tyro

from orient_eye.cli.tables import say
from orient_eye.commands.pulses import PULSES
from orient_eye.errors import InputError
from orient_eye.learning.engines import ENGINES
from orient_eye.plants import PLANTS, Option
from orient_eye.registry import Registry
from orient_eye.task.cases import CASES
from orient_eye.task.target_sets import TARGETS

T = TypeVar("T")
REGISTRIES: dict[str, Registry[Any]] = {
    "plant": PLANTS, "case": CASES, "targets": TARGETS, "pulse": PULSES, "engine": ENGINES,
}  # fmt: skip
"""Field of a command to where its names stand."""
_RIG = "rig"
"""The option of a plant that also says something of a policy's own plant, and that a command may have as its own."""
_SERIES = "series"
"""Marks an option that takes several values in place of one."""
_CONFIG = (tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone)


@dataclass(frozen=True)
class Several:
    """Annotates a field that takes the options of a dataclass, each with several values.

    One of several numbers, as weights, has one value.
    """

    of: Any


def parse(command: type[T], arguments: Sequence[str], program: str | None = None) -> T:
    """A command from its arguments.

    Raises:
        InputError: an option of a plant that the chosen one has not.
        SystemExit: --help, or arguments that are none.
    """
    parsed = tyro.cli(
        offered(command), prog=program, args=arguments, description=inspect.getdoc(command), config=_CONFIG
    )
    return _as_written(command, parsed)


def offered(command: type[T], taken: frozenset[str] = frozenset()) -> type[T]:
    """A dataclass with the choices and options of the registries in place of its fields.

    Args:
        command: the dataclass.
        taken: names of options around it, which no plant's option may have.
    """
    own: list[tuple[str, Any, Any]] = []
    taken |= {each.name for each in fields(command)}  # type: ignore[arg-type]  # a dataclass by contract
    for each, hint in _hints(command):
        several = _several(hint)
        if several is not None:
            inner, name = in_series(offered(several.of, taken)), ""
        elif each.name == "plant_options":
            inner, name = _plant_options(taken), "plant"
        elif isinstance(hint, type) and is_dataclass(hint):
            inner, name = offered(hint, taken), ""
        else:
            if each.name in REGISTRIES:
                names = dict.fromkeys((*_extra(each), *REGISTRIES[each.name]))
                own.append((each.name, _one_of(hint, tuple(names)), field(default=each.default)))
            continue
        own.append((each.name, _annotated(inner, tyro.conf.arg(name=name)), field(default_factory=inner)))
    words = {"__doc__": command.__doc__}
    return make_dataclass(command.__name__, own, bases=(command,), frozen=True, namespace=words)


def _several(hint: Any) -> Several | None:
    extras = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((extra for extra in extras if isinstance(extra, Several)), None)


def in_series(made: Any) -> Any:
    """The dataclass that `offered` made, with several values for each field that has one; None where none is given."""
    own: list[tuple[str, Any, Any]] = []
    for each, hint in _hints(made):
        inner, *extras = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        parts = get_args(inner) if get_origin(inner) in (Union, UnionType) else (inner,)
        parts = tuple(part for part in parts if part is not NoneType)
        if is_dataclass(inner):
            kind = in_series(inner)
            own.append((each.name, _annotated(kind, *extras), field(default_factory=kind)))
        elif inner is bool:
            own.append((each.name, hint, field(default=each.default)))
        else:
            if not any(get_origin(part) in (tuple, dict) for part in parts):
                values: Any = (operator.getitem(Union, parts), ...)
                parts = (tuple.__class_getitem__(values),)
                extras.append(_SERIES)
            if each.default is not None:
                extras.append(tyro.conf.arg(help_behavior_hint=f"(default: {each.default})"))
            several = operator.getitem(Union, (*parts, None))
            own.append((each.name, _annotated(several, *extras) if extras else several, field(default=None)))
    return make_dataclass(made.__name__, own, bases=(made,), frozen=True, namespace={"__doc__": made.__doc__})


def _hints(command: Any) -> Iterator[tuple["Field[Any]", Any]]:
    hints = get_type_hints(command, include_extras=True)
    return ((each, hints[each.name]) for each in fields(command))


def _extra(each: "Field[Any]") -> tuple[str, ...]:
    """A default that stands for itself ("all")."""
    named = isinstance(each.default, str) and each.default not in REGISTRIES[each.name]
    return (str(each.default),) if named else ()


def _one_of(hint: Any, names: tuple[str, ...]) -> Any:
    """The annotation with one of these names in place of a string."""
    if hint is str:
        return operator.getitem(Literal, names)
    if get_origin(hint) is Annotated:
        inner, *extras = get_args(hint)
        return _annotated(_one_of(inner, names), *extras)
    parts = get_args(hint)
    return operator.getitem(Union, tuple(_one_of(part, names) for part in parts)) if parts else hint


def _annotated(hint: Any, *extras: Any) -> Any:
    return operator.getitem(Annotated, (hint, *extras))


def _plant_options(taken: frozenset[str]) -> type:
    """A dataclass of all plants' own options; its defaults stand for what is not given."""
    found: dict[str, list[tuple[str, Option]]] = {}
    for plant, option in _options_of_plants():
        others = found.setdefault(option.name, [])
        if option.name == _RIG and option.name in taken:
            continue  # the command's own says it all
        if option.name in taken or any(_kind(other) != _kind(option) for _, other in others):
            say(f"note: plant {plant!r} cannot have its option {_flag(option.name)}: another is of that name", "yellow")
        else:
            others.append((plant, option))
    made = []
    for name, group in found.items():
        if group:
            kind = group[0][1].type
            words = tyro.conf.arg(help=_help(group), help_behavior_hint="")
            hint = _annotated(kind if kind is bool else operator.or_(kind, None), words)
            made.append((name, hint, field(default=group[0][1].default if kind is bool else None)))
    return make_dataclass("PlantOptions", made, frozen=True, namespace={"__doc__": "Options that some plants have."})


def _options_of_plants() -> Iterator[tuple[str, Option]]:
    for plant in PLANTS:
        try:
            options = tuple(PLANTS[plant].options)
        except (InputError, AttributeError, TypeError) as error:  # another package's
            say(f"note: plant {plant!r} is left out: {error}", "yellow")
            continue
        for option in options:
            yield plant, option


def _kind(option: Option) -> tuple[Any, bool]:
    """What has to be the same of options of one name: the type, and whether a flag turns it on or off."""
    return option.type, option.type is bool and bool(option.default)


def _help(group: list[tuple[str, Option]]) -> str:
    """What an option does, for which plants, and what each takes it to be."""
    plants: dict[tuple[str, str], list[str]] = {}
    for plant, option in group:
        default = "" if option.type is bool or option.default is None else f"; default {option.default}"
        plants.setdefault((option.help, default), []).append(plant)
    return " ".join(f"{words} For {', '.join(names)}{default}." for (words, default), names in plants.items())


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _as_written(command: type[T], parsed: Any) -> T:
    """The command itself, from the dataclass that `offered` made of it."""
    values: dict[str, Any] = {}
    for each, hint in _hints(command):
        value = getattr(parsed, each.name)
        if _several(hint) is not None:
            value = values_of(value)
        elif each.name == "plant_options":
            value = _given(parsed.plant, value)
        elif isinstance(hint, type) and is_dataclass(hint):
            value = _as_written(hint, value)
        values[each.name] = value
    return command(**values)


def values_of(parsed: Any) -> dict[str, tuple[Any, ...]]:
    """Of each option that was given its values, from a dataclass that `in_series` made."""
    found: dict[str, tuple[Any, ...]] = {}
    for each, hint in _hints(type(parsed)):
        value = getattr(parsed, each.name)
        if is_dataclass(value):
            found |= values_of(value)
        elif value is not None and value is not each.default:
            found[each.name] = value if _SERIES in get_args(hint)[1:] else (value,)
    return found


def _given(plant: str | None, parsed: Any) -> dict[str, Any]:
    """The options of the plant that were given.

    Raises:
        InputError: one that the plant has not.
    """
    options = {f.name: getattr(parsed, f.name) for f in fields(parsed) if getattr(parsed, f.name) != f.default}
    unsaid = [name for name in options if name != _RIG] if plant is None else []
    if unsaid:
        raise InputError(f"{_flag(unsaid[0])} says more about a plant; name the plant too, by --plant")
    if plant is not None:
        check_plant_options(plant, options)
    return options


def check_plant_options(plant: str, options: Iterable[str]) -> None:
    """Refuse options of other plants.

    Raises:
        InputError: names the first.
    """
    has = {option.name for option in PLANTS[plant].options}
    for name in options:
        if name not in has:
            raise InputError(f"{_flag(name)} does nothing on plant {plant!r}; leave it out or choose another plant")
