"""Plain values for people."""

from typing import Any


def in_words(value: Any) -> str:
    """A plain value: numbers to six digits, lists and dictionaries spelled out."""
    if isinstance(value, dict):
        inner = {
            key: f"({in_words(item)})" if isinstance(item, dict) else in_words(item) for key, item in value.items()
        }
        return ", ".join(f"{key} = {item}" for key, item in inner.items())
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(in_words, value)) + "]"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def plant_in_words(identity: dict[str, Any]) -> str:
    """A plant's identity: "lpf (K = 1.4758, w0 = 17.5)"."""
    told = {key: value for key, value in identity.items() if key not in ("plant", "model", "motor", "axis")}
    words = [
        str(value) if key == "eye" else in_words({key: value})
        for key, value in told.items()
        if value is not False and value is not None
    ]
    return f"{identity.get('plant')} ({', '.join(words)})" if words else str(identity.get("plant"))
