"""How our time grows with rays, samples, plane cells and pixels, and what a second thread gains: tables, and a picture
with a panel for each size. See scripts/measure-scaling."""

import argparse
import json
import math
import os
import statistics
from pathlib import Path

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot
from matplotlib.ticker import LogLocator

from program import OURS, THREADS, Program, measure

STEP = {"workload": "scene step", "planes": 128, "rays": 1024, "samples": 128}
STEP_WITHOUT_UNETS = {**STEP, "encoding": "vanilla"}  # planes are parameters
STYLISE = {"workload": "stylise", "tokens": 4096}
FRAME = {"workload": "frame", "planes": 128, "samples": 128, "threshold": 0}
PICTURES = [{"height": height, "width": width} for height, width in [(68, 120), (135, 240), (270, 480), (540, 960)]]


def series(quick):
    """(what grows, what is measured, [(size, request)])"""
    last = 3 if quick else 4
    for name, step in [("scene step, 128x128 planes", STEP), ("the same without U-Nets", STEP_WITHOUT_UNETS)]:
        yield "rays", f"{name}, 128 samples", [(rays, {**step, "rays": rays}) for rays in [512, 1024, 2048, 4096][:last]]
        yield "samples", f"{name}, 1024 rays", [
            (samples, {**step, "samples": samples}) for samples in [32, 64, 128, 256][:last]]
    yield "plane cells", "scene step, 1024 rays x 64", [
        (planes**2, {**STEP, "planes": planes, "samples": 64}) for planes in [64, 128, 256, 512][:last]]
    for name, work in [("stylise a map, 4096 tokens", STYLISE), ("frame of scene and person, 128 + 128 samples", FRAME)]:
        pictures = PICTURES[: last - 1]
        yield "pixels", name, [(size["height"] * size["width"], {**work, **size}) for size in pictures]


def times_of(requests, rounds, threads):
    """Median seconds of works, which take turns; `threads`: of each."""
    programs = {number: Program(OURS, threads[number]) for number in range(len(requests))}
    for number, request in enumerate(requests):
        programs[number].load(request)
    times = measure(programs, rounds)
    for program in programs.values():
        program.close()
    return [statistics.median(times[number]) for number in range(len(requests))]


def growth(sizes, seconds):
    """The exponents of time = size^exponent, over all and the largest between neighbours."""
    def exponent(a, b):
        return math.log(seconds[b] / seconds[a]) / math.log(sizes[b] / sizes[a])

    return exponent(0, len(sizes) - 1), max(exponent(i, i + 1) for i in range(len(sizes) - 1))


def draw(found, path):
    figure, panels = pyplot.subplots(1, 4, figsize=(14, 3.6), constrained_layout=True)
    for panel, grows in zip(panels, dict.fromkeys(row["grows"] for row in found)):
        for row in (row for row in found if row["grows"] == grows):
            (line,) = panel.loglog(row["sizes"], row["seconds"], "o-", label=row["work"])
            linear = [row["seconds"][0] * size / row["sizes"][0] for size in row["sizes"]]
            panel.loglog(row["sizes"], linear, ":", color=line.get_color())
        panel.set_xlabel(grows)
        panel.set_xticks(row["sizes"], [str(size) for size in row["sizes"]], rotation=20)
        panel.minorticks_off()
        panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        panel.yaxis.set_major_formatter("{x:g}")
        panel.legend(fontsize=7)
    panels[0].set_ylabel("seconds (dotted: linear)")
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(prog="scripts/measure-scaling", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller sizes, few repetitions")
    parser.add_argument("-o", "--output", default="scaling.svg", metavar="FILE", help="the picture")
    parser.add_argument("--json", metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    rounds = 3 if options.quick else 9
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
    found = []
    print("| grows | work | seconds | exponent over all | largest between neighbours |\n|---|---|---|---|---|")
    for grows, work, points in series(options.quick):
        sizes, requests = [size for size, _ in points], [request for _, request in points]
        seconds = times_of(requests, rounds, [THREADS] * len(points))
        over_all, largest = growth(sizes, seconds)
        found.append({"grows": grows, "work": work, "sizes": sizes, "seconds": seconds, "exponent": over_all,
                      "largest_exponent": largest})
        cells = ", ".join(f"{size}: {time:.3g}" for size, time in zip(sizes, seconds))
        print(f"| {grows} | {work} | {cells} | {over_all:.2f} | {largest:.2f} |", flush=True)
    print("\n| work | one thread, s | two threads, s | gain |\n|---|---|---|---|")
    threads = []
    for work, request in [
        ("scene step, 128x128 planes, 1024 rays x 128", STEP),
        ("scene step, 256x256 planes, 4096 rays x 128", {**STEP, "planes": 256, "rays": 4096}),
        ("stylise a 240x135 map", {**STYLISE, **PICTURES[1]}),
        ("frame 240x135 of scene and person", {**FRAME, **PICTURES[1]}),
    ]:
        one, two = times_of([request, request], rounds, [1, THREADS])
        threads.append({"work": work, "one_thread_s": one, "two_threads_s": two})
        print(f"| {work} | {one:.3g} | {two:.3g} | {one / two:.2f} |", flush=True)
    draw(found, options.output)
    if options.json:
        Path(options.json).write_text(json.dumps({"growth": found, "threads": threads}, indent=1) + "\n")


if __name__ == "__main__":
    main()
