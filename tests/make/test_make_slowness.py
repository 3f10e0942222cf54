"""The time of a frame does not grow because other programs want the same core."""

import multiprocessing
import os
import time

import pytest

from hemline.make.slowness import ProcessorShare, measure_slowness


def work(seconds):
    """Keeps a core busy for so much processor time."""
    begin = time.process_time()
    while time.process_time() - begin < seconds:
        pass


def rival(core, ready):
    os.sched_setaffinity(0, {core})
    ready.set()
    work(60.0)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system does not pin a process to a core")
def test_the_share_of_a_core_is_measured():
    """A second process on the same core takes half of it; elapsed time times the share is what it was alone."""
    cores = os.sched_getaffinity(0)
    core, context = min(cores), multiprocessing.get_context("spawn")
    ready = context.Event()
    other = context.Process(target=rival, args=(core, ready), daemon=True)
    other.start()
    try:
        assert ready.wait(30)
        os.sched_setaffinity(0, {core})
        began = time.perf_counter()
        with ProcessorShare() as shared:
            work(0.5)
        elapsed = time.perf_counter() - began
    finally:
        os.sched_setaffinity(0, cores)
        other.kill()
        other.join()
    assert shared.share < 0.75
    assert elapsed > 0.6 and elapsed * shared.share == pytest.approx(0.5, rel=0.2)


def test_waiting_is_not_work():
    with ProcessorShare() as measured:
        time.sleep(0.2)
    assert measured.share < 0.5
    assert measure_slowness() > 0
