"""All benchmarks in sequence: `make bench`, or `python -m benchmarks`."""

from benchmarks import (
    automatic_substeps,
    bear_pile,
    candidate_search,
    contact_scenes,
    hanging_beam,
    implicit_scaling,
    live,
    live_page,
    projections,
    quadratic_tets,
    reading_fields,
    rigid_bodies,
    rigid_heap,
    startup,
    work_precision,
)

if __name__ == "__main__":
    startup.main()
    projections.main()
    automatic_substeps.main()
    hanging_beam.main()
    hanging_beam.main(busy=True)
    work_precision.main()
    implicit_scaling.main()
    candidate_search.main()
    contact_scenes.main()
    bear_pile.main((5, 10))
    quadratic_tets.main()
    reading_fields.run()
    rigid_bodies.run()
    rigid_heap.main()
    live.run()
    live_page.run()
