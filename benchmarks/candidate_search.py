"""Cost of the search for contact alone, in piles of 5 to 100 gummy bears: time, memory, and the exponent of growth.

usage: python -m benchmarks.candidate_search [--quick]

`search` is a search in which everything has moved, `kept` one in which nothing left the margins of the latest one,
`step` the bound on a step. Times are those of the processor on one thread; the fastest of several counts.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

import supple as sp
from benchmarks.table import Table
from supple.contact.candidates import CandidateFinder
from supple.contact.ccd import largest_step
from supple.contact.mesh.contact_mesh import ContactMesh, mesh_of_triangles
from supple.numerics.geometry.embedded_points import EmbeddedPoints

COUNTS = (5, 10, 20, 50, 100)
DHAT = 5e-3  # of a bear's height, about 1 m


def pile(count: int) -> tuple[ContactMesh, NDArray[np.float64]]:
    """Bears beside and above each other, slightly turned: the surface, and where its points are (s, 3)."""
    bear = sp.shapes.gummy_bear().surface
    used, triangles = np.unique(bear.triangles, return_inverse=True)
    one, triangles = bear.vertices[used], triangles.reshape(-1, 3).astype(np.int32)
    size = np.ptp(one, axis=0)
    side = int(np.ceil(count ** (1 / 3)))
    parts = []
    for k in range(count):
        c, s = np.cos(0.06 * np.sin(k)), np.sin(0.06 * np.sin(k))
        place = np.array([k % side, k // side**2, k // side % side]) * 1.005 * size
        parts.append(one @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + place)
    x = np.concatenate(parts)
    mesh = mesh_of_triangles(
        EmbeddedPoints.at_vertices(np.arange(len(x), dtype=np.int32)),
        np.concatenate([triangles + k * len(one) for k in range(count)]),
        np.repeat(np.arange(count, dtype=np.int32), len(one)),
        x,
        body_count=count,
        names=tuple(map(str, range(count))),
        collide=np.ones((count, count), dtype=np.bool_),
    )
    return mesh, x


def fastest(run: Callable[[int], object], rounds: int = 5) -> float:
    """[s] of the processor, after one round for compilation; `run` takes the number of the round."""
    times = []
    for k in range(rounds + 1):
        begin = time.process_time()
        run(k)
        times.append(time.process_time() - begin)
    return min(times[1:])


def main(counts: tuple[int, ...] = COUNTS) -> dict[str, Any]:
    """Print the table; returns its figures."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    columns = {
        "bears": "d",
        "triangles": ",d",
        "pairs": ",d",
        "search, ms": ".1f",
        "kept, ms": ".3f",
        "step, ms": ".2f",
    }
    table = Table("Search for contact in piles of bears", columns, threads=1)
    times = []
    for count in counts:
        mesh, x = pile(count)
        finder = CandidateFinder(mesh, DHAT)
        way = 1e-3 * np.sin(70.0 * x[:, [2, 0, 1]])
        places = [x + 4e-3 * (k + 1) * np.sin(9.0 * x[:, [1, 2, 0]]) for k in range(6)]

        def search(k: int, finder=finder, places=places, way=way) -> None:
            finder.find(places[k], places[k] + way)

        times.append(fastest(search))
        near = finder.at(places[-1])
        kept = fastest(lambda _, finder=finder, at=places[-1]: finder.at(at))
        step = fastest(lambda _, mesh=mesh, at=places[-1], way=way, near=near: largest_step(mesh, at, way, near))
        table.add(count, len(mesh.triangles), len(near), 1e3 * times[-1], 1e3 * kept, 1e3 * step)
    numba.set_num_threads(before)
    exponent = float(np.polyfit(np.log(counts), np.log(times), 1)[0])
    table.note(f"The time of a search grows with the bears to the power {exponent:.2f} (target: at most 1.15).")
    return table.figures()


def run() -> None:
    """Measure, and print the table."""
    main()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the three smallest piles")
    if parser.parse_args().quick:
        main(COUNTS[:3])
    else:
        run()
