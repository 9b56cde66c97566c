"""Time from a slider of `percussion explore` to the drawn figures, in a headless Chromium.

`python -m benchmarks.explore` moves the slider of the feed force on the reference hammer, and tells
the medians of three parts: computing (the server's own clock), drawing (from the arrival of
the numbers to the end of the next frame), and what is left: the way there and back, with what
bokeh makes of it. The processor time of the server stands beside it: on a busy machine it
changes less. Take figures for the record on an idle machine, with compiled kernels.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.browser import browser, find_browser, tab

MODEL = "Bokeh.documents[0].get_model_by_name"
READY = (
    f"window.Bokeh && Bokeh.documents.length && {MODEL}('numbers')"
    f" && {MODEL}('numbers').tags[1] > 0"
)
# Moves the slider and resolves with total, computing and drawing time [ms].
MOVE = """
new Promise(done => {
  const model = name => Bokeh.documents[0].get_model_by_name(name);
  const numbers = model("numbers"), shown = numbers.tags[1], began = performance.now();
  const look = () => {
    if (numbers.tags[1] <= shown) return;
    numbers.properties.tags.change.disconnect(look);
    const came = performance.now();
    requestAnimationFrame(() => {  // a message arrives when the frame is drawn
      const {port1, port2} = new MessageChannel();
      port1.onmessage = () => {
        const drawn = performance.now();
        done([drawn - began, numbers.tags[2], drawn - came]);
      };
      port2.postMessage(0);
    });
  };
  numbers.properties.tags.change.connect(look);
  model("feed.force").value = %g;
})
"""


def processor_time(pid: int) -> float:
    """Processor time of a process that still runs [s]; NaN where the system does not tell."""
    file = Path(f"/proc/{pid}/stat")
    if not file.exists():
        return math.nan
    fields = file.read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def measure(url: str, folder: Path, count: int, pid: int) -> tuple[list[Any], float]:
    """Times of so many moves, each after the one before is drawn, and of the processor [ms].

    Parameters
    ----------
    url : str
    folder : Path
        For the browser.
    count : int
    pid : int
        Of the server.
    """
    with browser(folder) as port:
        async with tab(port) as page:
            await page.open(url)
            await page.until(READY)
            await page.wait(1000)
            for k in range(3):
                await page.ask(MOVE % (1500.0 + 100.0 * k))
            used = processor_time(pid)
            times = [await page.ask(MOVE % (2000.0 + 100.0 * k)) for k in range(count)]
            return times, 1e3 * (processor_time(pid) - used) / count


def main() -> None:
    """Measure and tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=40)
    moves = parser.parse_args().moves
    if find_browser() is None:
        raise SystemExit("no Chromium is installed to measure with")
    command = "from percussion_model.interface.cli import main; main()"
    server: Any = subprocess.Popen(
        [sys.executable, "-c", command, "explore", "--no-browser", "--port", "0"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        url = server.stdout.readline().split()[0]
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            work = measure(url, Path(folder), moves, server.pid)
            times, used = asyncio.run(work)
    finally:
        server.terminate()
        server.wait()
    total, compute, draw = ([row[k] for row in times] for k in range(3))
    transfer = [a - b - c for a, b, c in times]
    print(f"load {os.getloadavg()[0]:.1f}; {len(times)} moves, median (greatest) in ms")
    for name, values in (
        ("compute", compute), ("transfer", transfer), ("draw", draw), ("slider to frame", total),
    ):  # fmt: skip
        print(f"{name:16} {statistics.median(values):6.1f} ({max(values):.1f})")
    print(f"processor time of the server {used:.1f} ms a move")


if __name__ == "__main__":
    main()
