"""The progress line appears past two seconds, on stderr's terms."""

from __future__ import annotations

import io
import time

from supple.cli._progress import PATIENCE, Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def wait_for(stream: io.StringIO, text: str) -> None:
    limit = time.monotonic() + 5
    while text not in stream.getvalue():
        assert time.monotonic() < limit, stream.getvalue()
        time.sleep(0.005)


def test_patience_is_two_seconds() -> None:
    assert PATIENCE == 2.0


def test_what_is_quick_says_nothing() -> None:
    stream = io.StringIO()
    with Progress(stream) as progress:
        progress("mesh")
    assert stream.getvalue() == ""


def test_a_silent_stage_shows_by_itself_where_lines_scroll() -> None:
    stream = io.StringIO()
    with Progress(stream, patience=0.01) as progress:
        progress("rest shape")
        wait_for(stream, "rest shape (0 s)\n")
        progress("supine shape", 0.5)
        wait_for(stream, "supine shape 50 % (0 s)\n")
        progress("supine shape", 0.6)
        time.sleep(0.05)
    assert len(stream.getvalue().splitlines()) == 2, "one line a stage within ten seconds"


def test_on_a_terminal_one_line_is_overwritten_and_cleared() -> None:
    stream = Terminal()
    with Progress(stream, patience=0.01) as progress:
        progress("rest shape")
        wait_for(stream, "rest shape")
    assert "\n" not in stream.getvalue()
    assert stream.getvalue().endswith("\r\x1b[2K")
