"""Messages are strict and versioned, and the schema that the page's types are made from is theirs."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from rsrl.wall.messages import Clock, from_server, from_viewer
from rsrl.wall.schema import SCHEMA_FILE, schema_text

WATCH = {"version": 1, "type": "watch simulated", "race": "bahrain-2023"}


def test_the_committed_schema_is_that_of_the_messages() -> None:
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(), "run python -m rsrl.wall.schema"


def test_the_schema_has_both_sides() -> None:
    definitions = json.loads(schema_text())["$defs"]
    assert {"FromServer", "FromViewer", "Race", "CallMessage", "History", "WatchSimulated"} <= set(definitions)
    assert len(definitions["FromServer"]["oneOf"]) == 9


@pytest.mark.parametrize(
    "change",
    [
        {"version": 2},
        {"type": "watch"},
        {"seed": -1},
        {"seed": 2**32},
        {"seed": "1"},
        {"seed": 1.5},
        {"race": ""},
        {"race": "x" * 81},
        {"race": None},
        {"delay_s": 300.5},
        {"speed": 0.5},
        {"speed": 201.0},
        {"time_s": -1.0},
        {"lap": 0},
        {"path": "/etc/passwd"},
    ],
)
def test_a_wrong_message_is_refused(change: dict[str, object]) -> None:
    assert from_viewer.validate_json(json.dumps(WATCH))
    with pytest.raises(ValidationError):
        from_viewer.validate_json(json.dumps(WATCH | change))


@pytest.mark.parametrize("text", ["", "[]", "null", "{", '{"version":1}', '{"type":"clock","version":1,"command":"stop"}', "NaN", "1e999"])
def test_what_is_no_message_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        from_viewer.validate_json(text)


@given(st.recursive(st.none() | st.booleans() | st.floats() | st.text(max_size=8), lambda x: st.lists(x) | st.dictionaries(st.text(), x)))
def test_any_json_is_read_or_refused(document: object) -> None:
    with pytest.raises(ValidationError):
        from_viewer.validate_json(json.dumps(document))


def test_a_message_of_the_server_is_read_back_as_it_was() -> None:
    clock = Clock(
        session="s1", playing=True, time_s=1.5, lap=1, speed=10.0, known_s=9.0, known_lap=1, lap_starts_s=(0.0,), delay_s=0.0, live=False
    )
    assert from_server.validate_json(clock.model_dump_json()) == clock


def test_figures_that_json_does_not_have_are_refused() -> None:
    with pytest.raises(ValidationError):
        Clock(
            session="s1", playing=True, time_s=float("nan"), lap=1, speed=1.0, known_s=0.0, known_lap=1, lap_starts_s=(), delay_s=0.0,
            live=False,
        )  # fmt: skip
