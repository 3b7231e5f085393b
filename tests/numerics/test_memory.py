"""Memory that is available, estimates of what a simulation needs, and refusals with numbers."""

import re
import subprocess
import sys
import textwrap

import pytest

import supple as sp
from supple.runtime import memory
from supple.runtime.memory import available_bytes, in_words, require_memory

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4)


def scene(divisions=(2, 2, 2)):
    return sp.Scene([sp.Body("block", sp.shapes.box((1, 1, 1), divisions), RUBBER)])


def group(tmp_path, monkeypatch, kind, **files):
    """A machine with 8 GB available, and this process in the control group /a/b of that kind."""
    (tmp_path / "proc" / "self").mkdir(parents=True)
    (tmp_path / "proc" / "meminfo").write_text("MemTotal: 16000000 kB\nMemAvailable: 7812500 kB\n")
    (tmp_path / "proc" / "self" / "cgroup").write_text(kind)
    for name, text in files.items():
        path = tmp_path / "cgroup" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(memory, "_PROC", tmp_path / "proc")
    monkeypatch.setattr(memory, "_CGROUP", tmp_path / "cgroup")
    monkeypatch.setattr(memory, "_of_process", lambda: None)


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's files")
def test_the_machine_s_free_memory(tmp_path, monkeypatch):
    group(tmp_path, monkeypatch, "0::/\n")
    assert available_bytes() == 8_000_000_000


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's files")
def test_the_limit_of_an_enclosing_container_counts(tmp_path, monkeypatch):
    group(
        tmp_path,
        monkeypatch,
        "1:cpu:/x\n0::/a/b\n",
        **{
            "a/b/memory.max": "max\n",
            "a/b/memory.current": "5\n",
            "a/memory.max": "3000000000\n",
            "a/memory.current": "2500000000\n",
            "a/memory.stat": "anon 1\ninactive_file 500000000\n",
        },
    )
    assert available_bytes() == 1_000_000_000


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's files")
def test_the_limit_of_a_container_of_the_first_version_counts(tmp_path, monkeypatch):
    files = {"memory.limit_in_bytes": "3000000000\n", "memory.usage_in_bytes": "1000000000\n"}
    files = {f"memory/a/{name}": text for name, text in files.items()}
    group(tmp_path, monkeypatch, "4:memory:/a\n", **files)
    assert available_bytes() == 2_000_000_000


@pytest.mark.skipif(sys.platform != "linux", reason="limits the address space")
def test_the_limit_of_the_process_counts():
    code = """
        import resource
        resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))
        from supple.runtime.memory import available_bytes
        print(available_bytes())
    """
    answer = subprocess.check_output([sys.executable, "-c", textwrap.dedent(code)], text=True)
    assert 0 < int(answer) < 1 << 30


def test_words():
    assert [in_words(n) for n in (0, 999, 1000, 3_240_000_000, 2e12)] == ["0 B", "999 B", "1 kB", "3.24 GB", "2 TB"]


def test_what_does_not_fit_is_refused_with_both_numbers(monkeypatch):
    cube = scene((6, 6, 6))
    monkeypatch.setattr(memory, "available_bytes", lambda: 1_000_000)
    require_memory(1_000_000, "it", "do less")
    with pytest.raises(sp.SceneError, match=r"^it needs about 1\.01 MB of memory, and 1 MB are free; do less$"):
        require_memory(1_010_000, "it", "do less")
    with pytest.raises(
        sp.SceneError, match=r"^simulate: the scene of 1296 tets needs about 2\.59 MB of memory, and 1 MB"
    ):
        sp.simulate(cube, sp.XPBD(), 0.01, 1)
    with pytest.raises(sp.MeshError, match=r"box: a mesh of 6e\+03 elements needs about 6 MB of memory, .* divisions"):
        sp.shapes.box((1, 1, 1), (10, 10, 10))
    monkeypatch.setattr(memory, "available_bytes", lambda: None)  # a system that does not tell
    require_memory(1e30, "it", "do less")


def test_a_factorization_and_quadratic_tets_need_more():
    small = scene((3, 3, 3))
    assert sp.Implicit(linear_solver="direct").bytes_needed(small) > sp.Implicit().bytes_needed(small)
    body = small.bodies[0]
    large = sp.Scene([sp.Body("cube", body.mesh.to_order(2), body.material)])
    assert sp.Implicit().bytes_needed(large) > 2 * sp.Implicit().bytes_needed(small)
    assert sp.Implicit().bytes_needed(small) > sp.XPBD().bytes_needed(small) > 0


MEASURE = """
    import re, sys
    import supple as sp

    def kilobytes(name):
        return int(re.search(name + r":\\s+(\\d+)", open("/proc/self/status").read())[1])

    def run(n, solver):
        mesh = sp.shapes.box((1, 1, 1), (n, n, n))
        body = sp.Body("a", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.4), position=(0, 0.505, 0))
        scene = sp.Scene([body], obstacles=[sp.HalfSpace()])
        for _ in sp.simulate(scene, solver, 1 / 60, 2):
            pass
        return scene

    solver = sp.XPBD(substeps=2) if sys.argv[1] == "xpbd" else sp.Implicit()
    run(3, solver)  # loads
    open("/proc/self/clear_refs", "w").write("5")  # the peak begins here
    before = kilobytes("VmRSS")
    scene = run(22, solver)
    print(1024 * (kilobytes("VmHWM") - before), solver.bytes_needed(scene))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's files")
@pytest.mark.parametrize("solver", ["xpbd", pytest.param("implicit", marks=pytest.mark.slow)])
def test_the_estimate_is_at_least_what_is_used_and_at_most_six_times_as_much(solver):
    # The first run compiles what such a large scene needs, which takes memory of its own.
    for _ in range(2):
        program = [sys.executable, "-c", textwrap.dedent(MEASURE), solver]
        answer = subprocess.check_output(program, text=True, timeout=500)
    used, estimated = map(int, re.findall(r"\d+", answer))
    assert used <= estimated <= 6 * used
