"""The queue of a live run: order, what may be dropped and what waits, faults after what came before them, the end."""

import threading
import time

import pytest

from elusive.errors import DataError
from elusive.io.arrivals import AHEAD, Arrivals

HUNG_S = 30.0


def wait_until(holds):
    deadline = time.monotonic() + HUNG_S
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_what_waits_where_it_is_comes_whole_and_is_not_read_far_ahead():
    read = []

    def source():
        for number in range(200):
            read.append(number)
            yield number

    coming = Arrivals(source())
    taken = []
    for number in coming:
        taken.append(number)
        assert len(read) <= number + AHEAD + 3  # one on each side of the queue is under way
    assert taken == list(range(200))
    assert coming.dropped == 0


def test_nothing_is_read_before_the_first_is_asked_for():
    """Or what the tracker needs to make itself ready would count as time in which nothing came."""
    read = []

    def source():
        read.append(threading.current_thread().name)
        yield 0

    coming = Arrivals(source())
    frames = iter(coming)
    assert not coming._thread.is_alive()
    assert not read
    assert next(frames) == 0
    assert read == ["arrivals"]


def test_the_oldest_make_room_for_the_newest():
    all_read = threading.Event()

    def source():
        yield from range(100)
        all_read.set()

    coming = Arrivals(source(), most=8, may_drop=lambda item: True)
    frames = iter(coming)
    taken = [next(frames)]
    assert all_read.wait(HUNG_S)
    taken += frames
    assert taken[-8:] == list(range(92, 100))  # the newest are there
    assert taken == sorted(taken)
    assert coming.dropped == 100 - len(taken) > 80


def test_what_may_not_be_dropped_holds_up_what_may():
    coming = Arrivals(range(50), most=4, may_drop=lambda item: item >= 20)
    taken = []
    for item in coming:
        taken.append(item)
        time.sleep(0.001)
    assert taken[:20] == list(range(20))
    assert len(taken) + coming.dropped == 50


def test_a_fault_comes_after_what_came_before_it():
    def source():
        yield from (1, 2, 3)
        raise DataError("the cable is out.")

    frames = iter(Arrivals(source()))
    assert [next(frames) for _ in range(3)] == [1, 2, 3]
    with pytest.raises(DataError, match="the cable is out"):
        next(frames)


def test_a_stop_ends_a_wait_and_wakes_the_source():
    asleep, halted = threading.Event(), threading.Event()

    def source():
        yield 1
        asleep.set()
        halted.wait(HUNG_S)

    coming = Arrivals(source(), halt=halted.set)
    frames = iter(coming)
    assert next(frames) == 1
    assert asleep.wait(HUNG_S)
    coming.stop()
    assert list(frames) == []
    assert halted.is_set()
    wait_until(lambda: not coming._thread.is_alive())


def test_each_item_knows_when_it_came():
    class At(float):
        came_s = 12.5

    coming = Arrivals([At(1.0)])
    assert [(item, coming.came_s) for item in coming] == [(1.0, 12.5)]
    before_s = time.monotonic()
    coming = Arrivals([1])
    assert [before_s <= coming.came_s <= time.monotonic() for _ in coming] == [True]
