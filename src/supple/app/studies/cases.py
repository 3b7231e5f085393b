"""The cases of a study: their names, their folders, and the results that are kept there."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from supple import __version__
from supple.runtime.replacing import whole_file

CASES, RESULT, RECORDING, LOG, CHECKPOINT = "cases", "result.json", "recording.vtkhdf", "log.txt", "checkpoint"
_DIGITS = 16  # of the hash in a folder's name: a chance of 1e-8 that two of a million cases have the same


@dataclass(frozen=True)
class Case:
    """One combination of values.

    Attributes
    ----------
    key : hash of everything that the results depend on; name of the case's folder
    values : of the factors
    """

    key: str
    values: Mapping[str, Any]

    def folder(self, study: Path) -> Path:
        return study / CASES / self.key


@dataclass(frozen=True)
class CaseResult:
    """How a case ended.

    Attributes
    ----------
    status : "done", "failed", or "deferred" where the worker has not enough memory for it
    measures : by name; empty unless done
    reason : one line, why it failed
    measured_by : the identity of what measured; other measures are taken from the recording
    simulated : whether the recording is complete, so that other measures can be taken from it
    lost : whether it failed because its worker was lost, which is worth another try
    bytes_needed : estimate [bytes]; 0 where the case was not built
    """

    status: Literal["done", "failed", "deferred"]
    measures: dict[str, float] = field(default_factory=dict)
    reason: str = ""
    measured_by: str = ""
    frames: int = 0
    wall_seconds: float = 0.0
    simulated: bool = False
    lost: bool = False
    bytes_needed: int = 0


def case_key(identity: str) -> str:
    """The name of a case's folder. Another version of Supple may give other results."""
    return hashlib.sha256(f"{__version__}\n{identity}".encode()).hexdigest()[:_DIGITS]


def write_result(folder: Path, result: CaseResult) -> None:
    """Keep a result in the case's folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / RESULT) as fresh:
        fresh.write_text(json.dumps(asdict(result), indent=1) + "\n", encoding="utf-8")


def read_result(folder: Path) -> CaseResult | None:
    """The result in a case's folder; None where none exists, or none that can be understood."""
    try:
        data = json.loads((folder / RESULT).read_text(encoding="utf-8"))
        result = CaseResult(**data)
        measures = {str(name): float(value) for name, value in result.measures.items()}
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        return None
    known = result.status in ("done", "failed") and isinstance(result.reason, str)
    return CaseResult(**{**data, "measures": measures}) if known else None
