"""The JSON schema of all messages, from which the types of the page are made: `python -m rsrl.wall.schema` writes it."""

import json
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import TypeAdapter

from rsrl.wall.messages.server import from_server
from rsrl.wall.messages.viewer import from_viewer

SCHEMA_FILE: Final = Path(__file__).parent / "schema.json"


def schema_text() -> str:
    """The schema as JSON text: definitions of all types, and `FromServer` and `FromViewer`, any message of either side."""
    inputs: list[tuple[str, Literal["serialization", "validation"], TypeAdapter[Any]]] = [
        ("server", "serialization", from_server),
        ("viewer", "validation", from_viewer),
    ]
    unions, schema = TypeAdapter.json_schemas(inputs, ref_template="#/$defs/{model}")
    definitions = schema["$defs"] | {"FromServer": unions["server", "serialization"], "FromViewer": unions["viewer", "validation"]}
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Messages of the pit wall", "$defs": definitions}
    return json.dumps(document, indent=1) + "\n"


if __name__ == "__main__":
    SCHEMA_FILE.write_text(schema_text(), encoding="utf-8")
