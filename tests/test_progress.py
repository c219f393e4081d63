"""Progress in a log: a plain line every half minute, with the time left at the rate so far."""

import io
import sys

import pytest

from rislam_rt import progress
from rislam_rt.cli.progress_bars import show_progress
from rislam_rt.progress import EVERY, plain_lines


def test_a_stage_has_a_line_every_half_minute_with_share_and_time_left() -> None:
    now, lines = [0.0], list[str]()
    tell = plain_lines(lines.append, clock=lambda: now[0])
    for cycle in range(301):  # 0.5 s each
        now[0] = 0.5 * cycle
        tell("optimized", cycle, 300)
    assert lines == [f"optimized: {n} of 300 ({n // 3}%), 0:0{(300 - n) // 120}:{(300 - n) // 2 % 60:02d} left"
                     for n in (60, 120, 180, 240)]  # fmt: skip
    assert EVERY == 30.0


def test_stages_side_by_side_have_lines_of_their_own_and_count_from_their_first_report() -> None:
    now, lines = [0.0], list[str]()
    tell = plain_lines(lines.append, clock=lambda: now[0])
    tell("random", 100, 200)  # what was there already took no time of this run
    tell("no_ris", 0, 1000)
    now[0] = 4000.0
    tell("random", 150, 200)
    tell("no_ris", 100, 1000)
    tell("no_ris", 101, 1000)
    assert lines == ["random: 150 of 200 (75%), 1:06:40 left", "no_ris: 100 of 1000 (10%), 10:00:00 left"]


@pytest.mark.parametrize(("terminal", "said"), [(False, True), (True, False)])
def test_bars_have_lines_beside_them_where_the_stream_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, said: bool
) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "EVERY", 0.0)
    with show_progress() as tell:
        tell("optimized", 0, 10)
        tell("optimized", 3, 10)
        assert ("optimized: 3 of 10 (30%), 0:00:00 left\n" in stream.getvalue()) == said
