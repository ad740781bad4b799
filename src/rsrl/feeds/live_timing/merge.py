"""The state of a topic: the opening snapshot and every delta since, merged."""

from collections.abc import Mapping
from typing import Any

__all__ = ["merge"]


def merge(state: dict[str, Any], delta: Mapping[str, Any]) -> None:
    """Merge a delta of the feed into the state of its topic, in place.

    Mappings are merged key by key, whatever else there is replaces what was there. A list is a mapping by index, since later deltas name
    its elements by index: the feed opens with `[{...}]` and goes on with `{"1": {...}}`. `_deleted` lists keys to take out; other keys
    with an underscore belong to the transport.
    """
    for key, value in delta.items():
        if key[:1] == "_":
            if key == "_deleted" and isinstance(value, list):
                for name in value:
                    state.pop(str(name), None)
            continue
        if isinstance(value, list):
            value = {str(i): one for i, one in enumerate(value)}
        if isinstance(value, dict):
            old = state.get(key)
            if not isinstance(old, dict):
                old = state[key] = {}
            merge(old, value)
        else:
            state[key] = value
