"""Who can write compiled kernels can run code: files and folders that others can write are not read."""

import os
import stat
import sys

import pytest

from supple.runtime import kernel_cache, kernel_folder
from supple.runtime.kernel_cache import njit
from supple.runtime.kernel_folder import is_trusted, lock, read, write

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes of this kind")


@pytest.fixture
def folder(tmp_path):
    kernel_folder._warn.cache_clear()
    path = tmp_path / "kernels"
    held, _ = lock(path / "a.kernel")  # makes it
    assert held is not None
    held.release()
    write(path / "a.kernel", b"code")
    return path


def test_entries_can_be_written_by_their_user_only(folder, caplog):
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert stat.S_IMODE((folder / "a.kernel").stat().st_mode) == 0o600
    assert read(folder / "a.kernel") == b"code"
    assert not caplog.records


@pytest.mark.parametrize("mode", [0o620, 0o602, 0o666])
def test_a_file_that_others_can_write_is_not_read(folder, caplog, mode):
    (folder / "a.kernel").chmod(mode)
    assert read(folder / "a.kernel") is None
    assert read(folder / "a.kernel") is None
    assert [record.levelname for record in caplog.records] == ["WARNING"]  # once
    assert f"compiled kernels in {folder} are not used" in caplog.text
    (folder / "a.kernel").chmod(0o644)
    assert read(folder / "a.kernel") == b"code"


@pytest.mark.parametrize("mode", [0o770, 0o777, 0o1777])
def test_a_folder_that_others_can_write_is_neither_read_nor_written(folder, mode):
    folder.chmod(mode)
    assert read(folder / "a.kernel") is None
    assert lock(folder / "b.kernel") == (None, False)
    with pytest.raises(PermissionError):
        write(folder / "b.kernel", b"code")
    assert sorted(path.name for path in folder.iterdir()) == ["a.kernel"]


def test_a_kernel_in_such_a_folder_is_compiled_and_runs(tmp_path, monkeypatch):
    """Also where the file would run other code when it is unpickled."""
    folder, marker = tmp_path / "kernels", tmp_path / "marker"
    folder.mkdir(mode=0o700)
    monkeypatch.setattr(kernel_folder, "kernel_folder", lambda: folder)

    class Attack:
        def __reduce__(self):
            return os.mkdir, (str(marker),)

    def tripled(x):
        return 3.0 * x

    assert njit(cache=True)(tripled)(2.0) == 6.0
    (entry,) = folder.glob("*.kernel")
    write(entry, kernel_cache.dumps(Attack()))
    entry.chmod(0o666)
    assert njit(cache=True)(tripled)(2.0) == 6.0
    assert not marker.exists()
    assert stat.S_IMODE(entry.stat().st_mode) == 0o600  # replaced by what was compiled
    assert njit(cache=True)(tripled)(2.0) == 6.0


def status(mode, user, group=0):
    return os.stat_result((mode, 0, 0, 1, user, group, 0, 0, 0, 0))


def test_owners():
    own, other = os.getuid(), os.getuid() + 1
    assert is_trusted(status(0o600, own))
    assert is_trusted(status(0o644, 0))
    assert not is_trusted(status(0o600, other))
    # The folder of a wheel: trusted as far as the package beside it.
    package = status(0o664, other, group=7)
    assert is_trusted(status(0o664, other, group=7), package)
    assert is_trusted(status(0o644, other), package)
    assert not is_trusted(status(0o664, other, group=8), package)
    assert not is_trusted(status(0o666, other, group=7), package)
    assert not is_trusted(status(0o644, other + 1), package)


def test_kernels_of_a_wheel_may_belong_to_root_and_not_be_writable_by_others(folder, monkeypatch):
    monkeypatch.setattr(kernel_folder, "SHIPPED", folder)
    entry = folder / "a.kernel"
    monkeypatch.setattr(os, "fstat", lambda _: status(0o644, 0))
    assert read(entry) == b"code"
    monkeypatch.setattr(os, "fstat", lambda _: status(0o646, 0))
    assert read(entry) is None
