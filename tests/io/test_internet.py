"""Datagrams out of frames: fragments are put together, contradictions left out, and nothing grows without end."""

from __future__ import annotations

import struct
from collections import Counter
from itertools import pairwise

import numpy as np

from elusive.io._internet import MAX_PENDING, Frame, datagrams
from elusive.io._sentences import Sentences
from elusive.io.nmea import checksum

RAW = 101  # link layer


def udp(payload: bytes) -> bytes:
    return struct.pack(">HHHH", 4000, 8600, 8 + len(payload), 0) + payload


def ipv4(octets: bytes, identity: int, offset: int, more: bool) -> Frame:
    word = offset // 8 | 0x2000 * more
    head = struct.pack(">BBHHHBBH8s", 0x45, 0, 20 + len(octets), identity, word, 64, 17, 0, b"\x0a\0\0\1" * 2)
    return Frame(1.0, RAW, head + octets)


def ipv6(octets: bytes, identity: int, offset: int, more: bool) -> Frame:
    fragment = struct.pack(">BBHI", 17, 0, offset | more, identity)
    head = struct.pack(">IHBB32s", 0x60000000, 8 + len(octets), 44, 64, b"\x01" * 32)
    return Frame(1.0, RAW, head + fragment + octets)


def pieces(made, payload: bytes, identity: int = 7, size: int = 1000) -> list[Frame]:
    octets = udp(payload)
    return [made(octets[k : k + size], identity, k, k + size < len(octets)) for k in range(0, len(octets), size)]


def test_fragments_in_any_order_make_the_datagram():
    rng = np.random.default_rng(0)
    payload = rng.bytes(17_000)
    for made in (ipv4, ipv6):
        for _ in range(5):
            whole, counts = pieces(made, payload), Counter[str]()
            (found,) = datagrams([whole[k] for k in rng.permutation(len(whole))], counts)
            assert found.payload == payload
            assert found.destination.endswith(":8600")
            assert counts["incomplete"] == 0


def test_datagrams_that_interleave_are_told_apart():
    one, other = b"1" * 5000, b"2" * 5000
    frames = [f for pair in zip(pieces(ipv4, one, 1), pieces(ipv4, other, 2), strict=True) for f in pair]
    assert [found.payload for found in datagrams(frames)] == [one, other]


def test_fragments_that_contradict_each_other_are_left_out():
    whole = pieces(ipv4, b"x" * 3000)
    cases = {
        "missing": whole[:1] + whole[2:],
        "overlap": [*whole[:1], ipv4(b"y" * 1000, 7, 504, True), *whole[2:]],
        "changed": [*whole[:1], ipv4(b"y" * 1000, 7, 0, True), *whole[1:]],
        "two ends": [*whole[:2], ipv4(b"z" * 8, 7, 2000, False), whole[3]],
        "odd": [ipv4(b"z" * 9, 7, 0, True), *whole[1:]],
        "too long": [ipv4(b"z" * 800, 7, 65_528, False)],
    }
    for frames in cases.values():
        counts = Counter[str]()
        assert [found for found in datagrams(frames, counts) if found.payload == b"x" * 3000] == []
        assert counts["incomplete"]
    again = [*cases["missing"], *pieces(ipv4, b"y" * 3000, 8)]
    assert [found.payload for found in datagrams(again)] == [b"y" * 3000]


def test_beginnings_without_end_are_given_up():
    counts = Counter[str]()
    frames = (ipv4(b"x" * 8, k, 0, True) for k in range(4 * MAX_PENDING))
    assert list(datagrams(frames, counts)) == []
    assert counts["incomplete"] == 4 * MAX_PENDING


def sentence(body: str) -> bytes:
    return f"${body}*{checksum(body):02X}\r\n".encode("ascii")


def test_sentences_over_tcp_survive_cuts_repeats_and_gaps():
    rng = np.random.default_rng(1)
    lines = [sentence(f"HEHDT,{k:.1f},T") for k in range(100)]
    stream, first = b"".join(lines), 2**32 - 500
    cuts = [0, len(lines[0]), *sorted(rng.integers(20, len(stream), 60)), len(stream)]
    segments = [(a, stream[a:b]) for a, b in pairwise(cuts)]
    reader, found = Sentences(), list[str]()
    for k, (at, octets) in enumerate(segments):
        for _ in range(1 + k % 2):  # every other one comes twice
            if octets:
                found += reader.read(segment(octets, first + at)) or []
    assert found == [line.decode().strip() for line in lines]
    reader, found = Sentences(), []
    for k, (at, octets) in enumerate(segments):
        if octets and k % 10 != 9:  # every tenth is lost
            found += reader.read(segment(octets, first + at)) or []
    assert 50 < len(found) < 100
    assert set(found) <= {line.decode().strip() for line in lines}
    assert reader.read(segment(b"\x17\x03 encrypted", 5)._replace(source="other:1")) is None


def segment(octets: bytes, sequence: int):
    head = struct.pack(">HHIIBBHHH", 2000, 40000, sequence & 0xFFFFFFFF, 0, 0x50, 0x10, 0, 0, 0)
    packet = struct.pack(">BBHHHBBH8s", 0x45, 0, 40 + len(octets), 1, 0, 64, 6, 0, b"\x0a\0\0\1" * 2) + head + octets
    (found,) = datagrams([Frame(1.0, RAW, packet)])
    return found
