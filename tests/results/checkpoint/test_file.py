"""Checkpoint files: they come back with the same bits, and every damage is one line."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.kinds.codec import encoded
from supple.model.state import State
from supple.results.checkpoint.file import MEMORIES, Checkpoint, RunFacts, read_checkpoint, write_checkpoint
from supple.solvers.implicit.stepping.integrators import INTEGRATORS, History

RUN = RunFacts(0, 10, 0.1, "abc", (0.0, 1.0), "XPBD()")


def state(memory=None):
    x = np.random.default_rng(1).normal(size=(5, 3))
    return State(0.3, x, -x, memory)


def checkpoint(memory=None):
    return Checkpoint(RUN, 3, state(memory), (replace(state(), time=0.0),), (np.ones((2, 3)),), {"numpy": "2"})


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "00000003.checkpoint"
    write_checkpoint(path, checkpoint(History(np.ones((5, 3)), np.zeros((5, 3)), 0.1)))
    return path


def test_a_checkpoint_comes_back(path):
    read, written = read_checkpoint(path), checkpoint()
    assert (read.run, read.index, read.versions) == (RUN, 3, {"numpy": "2"})
    for one, other in ((read.state, written.state), (read.start_states[0], written.start_states[0])):
        assert one.time == other.time
        assert one.positions.tobytes() == other.positions.tobytes()
        assert one.velocities.tobytes() == other.velocities.tobytes()
    assert isinstance(read.state.memory, History)
    assert read.state.memory.step == 0.1
    assert np.array_equal(read.anchors[0], np.ones((2, 3)))
    assert read.state.positions.flags.writeable


def damage(path, data):
    path.write_bytes(data)
    with pytest.raises(OutputError) as caught:
        read_checkpoint(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text


def test_every_changed_byte_is_found(path):
    data = path.read_bytes()
    for k in range(len(data)):
        changed = bytearray(data)
        changed[k] ^= 0x10
        damage(path, bytes(changed))


def test_every_cut_is_found(path):
    data = path.read_bytes()
    for length in range(0, len(data), 7):
        damage(path, data[:length])
    damage(path, data + b"\0")


def test_other_files_are_named(path):
    data = path.read_bytes()
    assert "another version; simulate it again" in damage(path, data.replace(b"checkpoint 1\n", b"checkpoint 2\n"))
    assert "is not a checkpoint" in damage(path, b"\x89HDF\r\n")
    path.unlink()
    with pytest.raises(OutputError, match="cannot be read: No such file"):
        read_checkpoint(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"index": 11},
        {"index": -1},
        {"start_states": ()},
        {"state": State(0.3, np.zeros((4, 3)), np.zeros((5, 3)))},
        {"state": State(0.3, np.zeros((5, 3), dtype=np.float32), np.zeros((5, 3)))},
        {"start_states": (State(0.0, np.zeros((4, 3)), np.zeros((4, 3))),)},
        {"anchors": (None,)},
        {"run": replace(RUN, dt=None)},
        {"run": None},
    ],
    ids=str,
)
def test_contradictions_are_found_behind_a_right_checksum(path, changes):
    write_checkpoint(path, replace(checkpoint(), **changes))
    assert "is damaged" in damage(path, path.read_bytes())


def test_a_file_that_cannot_be_written_leaves_the_old_one(path, monkeypatch):
    before = path.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OutputError, match="No space left on device"):
        write_checkpoint(path, checkpoint())
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


SOLVERS = {
    "xpbd": sp.XPBD(substeps=2),
    **{name: sp.Implicit(integrator=name) for name in INTEGRATORS},
}


@pytest.mark.parametrize("name", SOLVERS)
def test_the_memory_of_every_solver_is_registered(name):
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1))
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3, damping=0.01)
    bodies = [sp.Body(f"cube {k}", mesh, material, position=(0, 1.3 * k, 0), friction=0.5) for k in range(2)]
    pins = [sp.Pin(body.name, [0, 1, 2]) for body in bodies]
    scene = sp.Scene(bodies, obstacles=[sp.HalfSpace(point=(0, -0.6, 0), friction=0.5)], pins=pins)
    *_, last = sp.simulate(scene, SOLVERS[name], 1 / 60, 2)
    encoded(last.state.memory, {kind.__name__: kind for kind in MEMORIES})


def test_the_names_of_memories_differ():
    names = [kind.__name__ for kind in (*MEMORIES, Checkpoint, RunFacts, State)]
    assert len(set(names)) == len(names)
