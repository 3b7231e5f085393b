"""The live page's cost: the same frames without it, in its own process, and with the page served, in turns.

usage: python -m benchmarks.live
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from benchmarks.measuring import in_turns, run_json

SCRIPT = Path(__file__).with_name("live_scene.py")
WAYS = {
    "headless": "simulate(), no page",
    "engine": "in the page's process for simulation, snapshots read at 60 Hz",
    "page": "the same with the page served, and a websocket that takes it all",
}


def main(rounds: int = 3, frames: int = 300) -> None:
    """Run all ways in turns and print them side by side."""
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    best = in_turns({way: lambda way=way: run_json(sys.executable, SCRIPT, way, frames) for way in WAYS}, rounds)
    base = best["headless"]["ms_per_frame"]
    tets = best["headless"]["tets"]
    print(f"\nXPBD, 20 substeps, {tets} tets, {frames} frames of 1/60 s, best of {rounds}; load at the start {load}")
    for way, text in WAYS.items():
        result = best[way]
        line = f"{text:<72} {result['ms_per_frame']:6.2f} ms/frame  {result['ms_per_frame'] / base:5.2f}"
        if "real_time_ratio" in result:
            line += f"  played: {result['real_time_ratio']:.3f} of real time, {result['played_ms']:.2f} ms a step"
        print(line)


if __name__ == "__main__":
    main()
