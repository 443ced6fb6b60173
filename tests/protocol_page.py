"""The messages on the page of the protocol."""

import json
import re
from pathlib import Path

PAGE = (Path(__file__).parents[1] / "docs" / "protocol.md").read_text(encoding="utf-8")
# Each request with its answer.
TRANSCRIPT = [
    tuple(map(json.loads, block.splitlines()))
    for block in re.findall(r"```json\n(.*?)```", PAGE, re.DOTALL)
]
