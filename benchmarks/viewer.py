"""Time to the viewer's first picture, pictures a second, and sizes of files: ``python -m benchmarks.viewer [--quick]``.

`rigid-env view drop` is started beside a browser that runs already (Chromium without a GPU, driven by Playwright); the
time ends when the block is on the page's canvas. In turns with it the same browser opens an empty page of viser, whose
server is there already: what viser's own page takes on this machine. Left out where there is no browser.

A process of its own stands for the browser: it reads what the server sends and counts the pictures, that is windows of
messages in which the first body has moved. `Stage.show` is called as fast as it goes, with all layers off but the
bodies, and every body moves and turns in every picture; the looks are made beforehand. Files are ten seconds at 30
pictures a second of the same motions, of which nothing rests.
"""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks import machine
from benchmarks.processes import killed_after, wait_for_end
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Spread, interleave
from rigid_env.rendering import BodyView, Frame, WallView
from rigid_env.terminal import make_console
from rigid_env.viewer.export import page_of
from rigid_env.viewer.interface import Look
from rigid_env.viewer.servers import address_of, server_for_a_while
from rigid_env.viewer.stage import LAYERS, Stage
from tests.viewer.browser import SIZE, Watched, browser, share_of, what_is_missing

BODIES = (1, 100)
FILE_BODIES = (1, 50)
TIMES = {1: 1e3 / 60.0, 100: 1e3 / 20.0}  # of a picture at most [ms]
SIZES = {1: 2.0, 50: 5.0}  # of a file at most [MB]
REPEATS, QUICK_REPEATS = 9, 2
SECONDS, QUICK_SECONDS = 2.0, 0.3  # of one repeat
FPS, DURATION = 30.0, 10.0
FIRST = 5.0  # time to the first picture at most [s]
BLOCK_COLOUR, BLOCK_SHARE = (45, 95, 170), 0.002  # of the drop's block, and the share of pixels that have it
NODE = "/scene/bodies/0.0"
PATIENCE = 60.0  # for the reader or the viewer to be there, and to end [s]


def motion(count: int, duration: float) -> Iterator[Look]:
    """Looks at blocks, spheres and ellipsoids that all move and turn all the time."""
    rng = np.random.default_rng(1)
    pos, speed = rng.uniform((-8, 1, -8), (8, 9, 8), (count, 3)), rng.uniform(-1.0, 1.0, (count, 3))
    size, axis = rng.uniform(0.4, 1.2, (count, 3)), rng.standard_normal((count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    floor, still = WallView((0.0, 1.0, 0.0)), np.zeros((count, 3))
    for k in range(round(duration * FPS) + 1):
        half = 0.5 * (k / FPS + np.arange(count))
        quat = np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * axis], axis=1)
        bodies = [
            BodyView(kind, size[b] if kind != "sphere" else np.full(3, size[b, 0]), pos[b], quat[b])
            for b, kind in zip(range(count), ("block", "sphere", "ellipsoid") * count)
        ]
        pos = pos + speed / FPS
        frame = Frame(tuple(bodies), (floor,))
        yield Look(frame, k / FPS, still, still, np.zeros(count, dtype=bool), frame.poses.radius, None, None)


def read(address: str, version: str, pipe) -> None:
    """Read what a server sends until the pipe says stop; send back the number of pictures, and bytes."""
    import msgspec
    import zstandard
    from websockets.sync.client import connect

    unpack, pictures, size = zstandard.ZstdDecompressor(), 0, 0
    with connect(address, subprotocols=[f"viser-v{version}"], max_size=None, compression=None) as socket:
        pipe.send("there")
        while not pipe.poll():
            try:
                window = socket.recv(timeout=0.05)
            except TimeoutError:
                continue
            length = int.from_bytes(window[8:16], "little")
            messages = msgspec.msgpack.decode(unpack.decompress(window[16 : 16 + length]))["messages"]
            moved = [m for m in messages if m.get("name") == NODE and "batched_positions" in m.get("updates", ())]
            pictures, size = pictures + bool(moved), size + len(window)
    pipe.send((pictures, size))


def run(count: int, seconds: float) -> dict:
    """Show looks for a while; pictures a second at the reader, times of `Stage.show` and bytes of a picture."""
    import viser

    looks = list(motion(count, 2.0))
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    with server_for_a_while() as server:
        stage = Stage(server)
        for name in LAYERS:
            stage.set_layer(name, False)
        stage.show(looks[0])
        address = f"ws://127.0.0.1:{server.get_port()}"
        reader = context.Process(target=read, args=(address, viser.__version__, there), daemon=True)
        reader.start()
        try:
            _answer(here)
            start, shown = time.perf_counter(), 0
            while (now := time.perf_counter()) < start + seconds:
                shown += 1
                stage.show(looks[shown % len(looks)])
                time.sleep(0.0)
            here.send("stop")
            pictures, size = _answer(here)
            reader.join(PATIENCE)
        finally:
            reader.kill()  # where it has not ended
    return {"arrived": pictures / (now - start), "shown": shown / (now - start), "bytes": size / max(pictures, 1)}


def _answer(pipe):
    """Message of the reader; an error where none comes."""
    if not pipe.poll(PATIENCE):
        raise RuntimeError(f"the reader has not answered for {PATIENCE:g} s")
    return pipe.recv()


def measure_pictures(count: int, is_quick: bool) -> Row:
    """Milliseconds of a picture that arrives, of a number of bodies."""
    repeats, seconds = (QUICK_REPEATS, QUICK_SECONDS) if is_quick else (REPEATS, SECONDS)
    found = [run(count, seconds) for _ in range(repeats)]
    times = Spread(tuple(1e3 / max(one["arrived"], 1e-3) for one in found))
    notes = {key: Spread(tuple(one[key] for one in found)).to_dict() for key in found[0]}
    what = f"a picture of {count} {'body' if count == 1 else 'bodies'} arrives"
    return Row(f"pictures_{count}", what, "ms", times, target=TIMES[count], is_ratio=False, notes=notes)


def time_to_picture(page, command: list[str]) -> float:
    """Time from the start of a command to the block in a page of a browser [s]."""
    watched, start = Watched(page), time.perf_counter()
    with running(command) as viewer:
        watched.open(address_told(viewer))
        watched.wait_for(lambda picture: share_of(picture, BLOCK_COLOUR) > BLOCK_SHARE)
        return time.perf_counter() - start


@contextmanager
def running(command: list[str], patience: float = PATIENCE) -> Iterator[subprocess.Popen]:
    """Run a command beside the block. It is told to end by SIGTERM, and killed `patience` [s] later."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            wait_for_end(process, patience)


def address_told(viewer: subprocess.Popen) -> str:
    """Address in the first line of a viewer; an error where it does not come."""
    with killed_after(viewer, PATIENCE):
        line = viewer.stdout.readline()
    if not line:
        raise RuntimeError(f"the viewer gave no address within {PATIENCE:g} s")
    return line.split()[-1]


def time_of_empty_page(page) -> float:
    """Time from the address of a server that shows nothing to its first picture in a page of a browser [s]."""
    watched = Watched(page)
    with server_for_a_while() as server:
        time.sleep(1.0)  # for its thread
        start = time.perf_counter()
        watched.open(address_of(server))
        watched.picture()
        return time.perf_counter() - start


def measure_first_picture(is_quick: bool) -> list[Row]:
    """Seconds to the first picture, warm, and of that an empty page; nothing where there is no browser."""
    if what_is_missing():
        return []
    view = [sys.executable, "-c", "from rigid_env.cli import app; app()", "view", "drop"]
    ways = {"first": partial(time_to_picture, command=view), "empty": time_of_empty_page}
    with browser() as opened:

        def run(way) -> float:
            page = opened.new_page(viewport=SIZE)
            seconds = way(page)
            page.close()
            return seconds

        times = interleave({name: partial(run, way) for name, way in ways.items()}, 1 if is_quick else REPEATS)
    first, empty = times["first"], times["empty"]
    return [
        Row("first_picture", "`rigid-env view drop` to its first picture", "s", first, target=FIRST, is_ratio=False),
        Row("empty_page", "an empty page of viser to its first picture", "s", empty, target=None, is_ratio=False),
    ]


def measure_file(count: int, is_quick: bool) -> Row:
    """Size of a file in megabytes."""
    duration = 0.5 if is_quick else DURATION
    size = len(page_of(motion(count, duration), duration=duration, fps=FPS).encode("utf-8")) / 1e6
    what = f"a file of {duration:g} s of {count} {'body' if count == 1 else 'bodies'}"
    return Row(f"file_{count}", what, "MB", Spread((size,)), target=SIZES[count], is_ratio=False)


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
) -> None:
    """Measure how soon the viewer shows a picture, how many a second leave its server, and how large its files are."""
    console = make_console()
    found = [measure_pictures(count, quick) for count in BODIES] + [measure_file(count, quick) for count in FILE_BODIES]
    found += measure_first_picture(quick)
    if reason := what_is_missing():
        console.print(f"the time to the first picture is left out: {reason}")
    console.print(make_table(found, machine.headline()))
    for row in found[: len(BODIES)]:
        arrived, size = row.notes["arrived"]["median"], row.notes["bytes"]["median"]
        console.print(f"{row.what}: {arrived:.0f} a second, {size:.0f} bytes each")
    if json is not None or not quick:
        console.print(f"written to {machine.keep('viewer', found, json, is_quick=quick, fps=FPS, duration=DURATION)}")


if __name__ == "__main__":
    typer.run(main)
