"""What a file is that was taken for another: a name for it and what it is for, by its first octets."""

from __future__ import annotations

RADAR = "`elusive track radar`"
IMAGES = "`elusive track images`"
CATEGORIES = (1, 2, 8, 10, 19, 20, 21, 23, 34, 48, 62, 63, 65, 240, 247)
KINDS = (
    (b"\x89PNG", f"a PNG image (for {IMAGES})"),
    (b"\xff\xd8\xff", f"a JPEG image (for {IMAGES})"),
    (b"GIF8", f"a GIF image (for {IMAGES})"),
    (b"II*\x00", f"a TIFF image (for {IMAGES})"),
    (b"MM\x00*", f"a TIFF image (for {IMAGES})"),
    (b"YUV4MPEG2", f"a camera's Y4M video (for {IMAGES})"),
    (b"\x1aE\xdf\xa3", f"a camera's Matroska video (for {IMAGES})"),
    (b"CDF", "netCDF 3, to be saved as netCDF 4"),
    (b"PK\x03\x04", "an archive"),
    (b"%PDF", "a PDF"),
    (b"SQLite", "a database"),
    (b"!", "a log of NMEA sentences"),
    (b"$", "a log of NMEA sentences"),
    (b"\\", "a log of NMEA sentences"),
)


def kind_of(head: bytes) -> str:
    """Say what a file is, by its first sixteen octets."""
    for start, said in KINDS:
        if head.startswith(start):
            return said
    if not head:
        return "empty"
    if head[4:8] == b"ftyp":
        return f"a camera's MP4 video (for {IMAGES})"
    if head[:4] == b"RIFF":
        return "a sound or a camera's video (RIFF)"
    if all(octet in b"\t\r\n" or 32 <= octet < 127 for octet in head):
        return f"text (plots in a table are for {RADAR})"
    return "of no kind that is known here"


def is_asterix(head: bytes) -> bool:
    """Whether a file may begin with a data block of ASTERIX, of whichever category."""
    text = all(octet in b"\t\r\n" or 32 <= octet < 127 for octet in head)
    return len(head) >= 3 and head[0] in CATEGORIES and int.from_bytes(head[1:3]) > 3 and not text
