"""All benchmarks in sequence: `make bench`, or `python -m benchmarks`."""

from benchmarks import (
    automatic_substeps,
    bear_pile,
    candidate_search,
    contact_scenes,
    hanging_beam,
    implicit_scaling,
    live,
    projections,
    quadratic_tets,
    reading_fields,
    rigid_bodies,
    rigid_heap,
    small_scenes,
    startup,
    tolerances,
    work_precision,
)

if __name__ == "__main__":
    startup.run()
    projections.run()
    automatic_substeps.run()
    hanging_beam.run()
    work_precision.run()
    implicit_scaling.run()
    candidate_search.run()
    contact_scenes.run()
    small_scenes.run()
    bear_pile.run()
    tolerances.write()
    quadratic_tets.run()
    reading_fields.run()
    rigid_bodies.run()
    rigid_heap.run()
    live.run()
