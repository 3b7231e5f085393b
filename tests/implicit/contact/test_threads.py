"""The contact library has one thread while any simulation uses it."""

import threading

import ipctk

from supple.implicit.contact.threads import one_contact_thread


def test_the_library_has_one_thread_until_the_last_simulation_leaves():
    before = ipctk.get_num_threads()
    ipctk.set_num_threads(2)
    try:
        entered, leave = threading.Event(), threading.Event()

        def other():
            with one_contact_thread():
                entered.set()
                leave.wait(10)

        thread = threading.Thread(target=other)
        with one_contact_thread():
            thread.start()
            assert entered.wait(10)
        assert ipctk.get_num_threads() == 1
        leave.set()
        thread.join()
        assert ipctk.get_num_threads() == 2
    finally:
        ipctk.set_num_threads(before)
