"""Studies whose cases need more memory than a process's share."""

import supple as sp


def needing_bytes():
    """A function of a case that needs as many bytes as its factor says; local, so that it is sent to the workers."""

    def make(tets):
        class Large(sp.XPBD):
            def bytes_needed(self, scene):
                return tets

        cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.EdgesAndVolume())
        return sp.Run(sp.Scene([cube]), Large(substeps=1, contact=None), 0.01, 2)

    return make


def test_a_case_too_large_for_its_share_of_the_memory_runs_alone(tmp_path, monkeypatch):
    def workers(recording):
        import os

        import numba

        return numba.get_num_threads() / (os.cpu_count() or 1)

    monkeypatch.setattr("supple.app.studies.executors.available_bytes", lambda: 4_000_000_000)
    values = [0, int(2e9), int(5e9)]
    table = sp.sweep(needing_bytes(), {"tets": values}, measure=workers, folder=tmp_path / "s", workers=2)
    assert table.done.tolist() == [True, True, False]
    assert table["measure"][1] == 1.0, "alone, it has all cores"
    assert table.reasons[2] == "needs about 5.3 GB of memory; 3.6 GB can be used here"
