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
    small_scenes,
    startup,
    work_precision,
)

if __name__ == "__main__":
    startup.run()
    projections.run()
    automatic_substeps.main()
<<<<<<< HEAD
    hanging_beam.main()
    hanging_beam.main(busy=True)
    work_precision.main()
    implicit_scaling.main()
    candidate_search.main()
    contact_scenes.main()
    bear_pile.main((5, 10))
    quadratic_tets.main()
    reading_fields.run()
=======
    hanging_beam.run()
    work_precision.run()
    implicit_scaling.run()
    candidate_search.run()
    contact_scenes.run()
    small_scenes.run()
    bear_pile.run()
    quadratic_tets.run()
>>>>>>> f417ce3e95075a4494f7c252a1f39a21eeb9e99c
    rigid_bodies.run()
    rigid_heap.run()
    live.run()
    live_page.run()
