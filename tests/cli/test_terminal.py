"""Tables and lines at any width: what is printed is whole."""

import contextlib
import io
import os
import pty
import re
import signal
import subprocess
import sys

import pytest
from rich.console import Console
from rich.text import Text

from benchmarks.processes import killed_after
from rigid_env.terminal import Column, Table, counted, make_console, number_columns, say

WIDTHS = (40, 60, 80, 120)


def printed(what, width: int) -> str:
    console = Console(width=width, file=io.StringIO(), markup=False, emoji=False, highlight=False)
    console.print(what)
    return console.file.getvalue()


def example() -> Table:
    columns = [
        Column("what"), Column("accuracy", is_whole=True, under="what"),
        *number_columns("ours [steps/s]", "peer", "ratio"), Column("pass", is_whole=True),
    ]  # fmt: skip
    table = Table(columns, "a title [s]", "a caption [m]")
    table.add_row("a block that is shoved about\nsteps/s", "balanced", "2.37 M\n2.31..2.48 M", "264 k", "8.97", "no")
    table.add_row("free flight", "fast", "23.1 M\n22.4..23.9 M", "588 k", "38.7", Text("yes", style="green"))
    return table


@pytest.mark.parametrize("width", WIDTHS)
def test_no_line_is_wider_than_the_terminal_and_no_word_is_lost(width):
    table = example()
    text = printed(table, width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    words = text.split()
    for cells in ([column.name for column in table.columns], *([cell.plain for cell in row] for row in table.rows)):
        for word in " ".join(cells).split():
            assert word in words
    assert "a title [s]" in text
    assert "a caption [m]" in text


def test_one_thing_is_no_plural():
    assert [counted(count, "trial") for count in (0, 1, 1200)] == ["0 trials", "1 trial", "1,200 trials"]


LATE = """
import atexit, os, signal
from rigid_env.terminal import run_program

def main():
    print("done", flush=True)

signal.signal(signal.SIGINT, signal.default_int_handler)  # a test run in the background has it ignored
atexit.register(os.kill, os.getpid(), signal.SIGINT)
run_program(main)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_at_the_end_of_a_program_gives_no_traceback():
    done = subprocess.run([sys.executable, "-c", LATE], capture_output=True, text=True, timeout=300, check=False)
    assert (done.stdout, done.stderr, done.returncode) == ("done\n", "", -signal.SIGINT)


def test_a_table_has_three_layouts():
    wide, stacked, listed = (printed(example(), width) for width in (120, 60, 40))
    assert wide.splitlines()[1].split() == ["what", "accuracy", "ours", "[steps/s]", "peer", "ratio", "pass"]
    assert stacked.splitlines()[1].split() == ["what"]
    assert stacked.splitlines()[2].split() == ["accuracy", "ours", "[steps/s]", "peer", "ratio", "pass"]
    assert "pass            yes" in listed


def test_numbers_are_never_broken_where_text_is():
    table = Table([Column("what"), *number_columns("value")])
    table.add_row("words " * 40, "-1.2345678e-12 m")
    for width in WIDTHS:
        assert "-1.2345678e-12 m" in printed(table, width)


def test_a_row_has_a_cell_for_each_column():
    with pytest.raises(ValueError, match="cells are 1; allowed are 2"):
        Table(["a", "b"]).add_row("x")


def test_lines_go_on_below_their_text():
    console = Console(width=40, file=io.StringIO())
    say(console, "status", "ok: every contact problem met its tolerance [m]")
    lines = console.file.getvalue().splitlines()
    assert [line[:12] for line in lines] == ["status      ", *[" " * 12] * (len(lines) - 1)]
    assert len(lines) > 1
    assert lines[-1].rstrip().endswith("[m]")


PROGRAM = """
from rigid_env.terminal import Column, Table, make_console
table = Table([Column("what [s]"), Column("result", is_number=True)], "t " * 60)
table.add_row("word " * 60, "1.25")
make_console().print(table)
"""


def environment(**more) -> dict:
    return {**{key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES")}, **more}


def test_piped_rows_are_one_line_each():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=environment())
    lines = done.stdout.splitlines()
    assert len(lines) == 4
    assert lines[1].split() == ["what", "[s]", "result"]
    assert lines[3].split()[-1] == "1.25"


def test_columns_hold_in_a_pipe_if_they_are_given():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=environment(COLUMNS="80")
    )  # fmt: skip
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert "1.25" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
@pytest.mark.parametrize("width", [80, 120])
def test_a_terminal_sets_the_width(width):
    import fcntl
    import struct
    import termios

    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
    process = subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=slave, env=environment(TERM="xterm"))
    os.close(slave)
    text = b""
    with killed_after(process, 300.0):
        with contextlib.suppress(OSError):  # the other side is closed
            while part := os.read(master, 4096):
                text += part
        assert process.wait() == 0
    lines = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text.decode()).splitlines()
    assert 0.9 * width < max(map(len, lines)) <= width
    assert any(line.rstrip().endswith("1.25") for line in lines)


def test_brackets_and_colons_are_text(capsys):
    make_console().print("time [s], [bold]no[/bold] :smile:")
    assert capsys.readouterr().out.strip() == "time [s], [bold]no[/bold] :smile:"
