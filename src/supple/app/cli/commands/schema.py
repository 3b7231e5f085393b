"""`supple schema`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter


def schema(
    of: Literal["scene", "study"] = "scene",
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Write the JSON Schema of scene files or of study files, for editors with completion and validation.

    Parameters
    ----------
    of
        Which files: scene or study.
    output
        File to write; without it, the schema is printed.
    """
    import json

    from supple.app.scene_file.document import json_schema
    from supple.app.studies.study_file import study_schema
    from supple.runtime.replacing import whole_file

    text = json.dumps(json_schema() if of == "scene" else study_schema(), indent=2) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    with whole_file(output) as fresh:
        fresh.write_text(text, encoding="utf-8")
    print(f"wrote {output}")
