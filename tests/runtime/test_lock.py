"""The lock of a folder: one holder at a time, and none left by a killed process."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from supple.errors import OutputError
from supple.runtime.lock import LOCK_NAME, FolderLock, is_locked

HOLDER = """
import sys, time
from pathlib import Path
from supple.runtime.lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
print("locked", flush=True)
time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the lock."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "locked\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_a_folder_is_locked_once(tmp_path):
    lock = FolderLock(tmp_path)
    assert is_locked(tmp_path)
    with pytest.raises(OutputError, match=rf"another run is writing to it \(process {os.getpid()}\); wait for it"):
        FolderLock(tmp_path)
    lock.release()
    lock.release()
    assert not is_locked(tmp_path)
    assert list(tmp_path.iterdir()) == []
    FolderLock(tmp_path).release()


def test_another_process_is_named(tmp_path, holder):
    assert is_locked(tmp_path)
    with pytest.raises(OutputError, match=rf"another run is writing to it \(process {holder.pid}\)"):
        FolderLock(tmp_path)


def test_the_lock_of_a_killed_process_is_free(tmp_path, holder):
    holder.kill()
    holder.wait()
    assert (tmp_path / LOCK_NAME).exists()
    assert not is_locked(tmp_path)
    FolderLock(tmp_path).release()


@pytest.mark.skipif(os.name != "posix", reason="only POSIX stops processes")
def test_a_stopped_process_keeps_its_lock(tmp_path, holder):
    holder.send_signal(signal.SIGSTOP)
    time.sleep(0.05)
    assert is_locked(tmp_path)


def test_asking_refuses_nobody(tmp_path):
    asking = threading.Event()

    def ask():
        while not asking.is_set():
            is_locked(tmp_path)

    asker = threading.Thread(target=ask)
    asker.start()
    try:
        for _ in range(200):
            FolderLock(tmp_path).release()
    finally:
        asking.set()
        asker.join()


def test_a_file_of_that_name_is_no_lock(tmp_path):
    (tmp_path / LOCK_NAME).write_text("anything")
    assert not is_locked(tmp_path)
    FolderLock(tmp_path).release()


def test_a_folder_that_does_not_exist(tmp_path):
    assert not is_locked(tmp_path / "missing")
    with pytest.raises(OutputError, match="No such file or directory"):
        FolderLock(tmp_path / "missing")
