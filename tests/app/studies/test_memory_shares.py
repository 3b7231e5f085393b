"""Studies whose cases need more memory than a worker's share."""

import numpy as np
import pytest

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


@pytest.mark.slow
def test_a_case_too_large_for_its_share_of_the_memory_runs_on_fewer_workers(tmp_path, monkeypatch):
    from supple.app.studies import workers as module

    def limit(recording):
        from distributed import get_worker

        return get_worker().memory_manager.memory_limit

    monkeypatch.setattr(module, "available_bytes", lambda: 4_000_000_000)
    values = [0, int(2e9), int(5e9)]
    table = sp.sweep(needing_bytes(), {"tets": values}, measure=limit, folder=tmp_path / "s", workers=2)
    assert table.done.tolist() == [True, True, False]
    np.testing.assert_allclose(table["measure"][:2], [1.8e9, 3.6e9], rtol=1e-3)
    assert table.reasons[2] == "needs about 5.3 GB of memory; 3.6 GB can be used here"


@pytest.mark.slow
def test_a_cluster_without_a_worker_large_enough(cluster, tmp_path):
    def frames(recording):
        return len(recording)

    table = sp.sweep(needing_bytes(), {"tets": [0, int(9e9)]}, measure=frames, folder=tmp_path / "s", scheduler=cluster)
    assert table["measure"].tolist()[0] == 3
    assert table.reasons[1] == "needs about 9.3 GB of memory; the largest worker has 2 GB"
