"""What our program needs in memory: a training step, a large stylised frame, and whether a long training grows. See
scripts/measure-memory."""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

from program import OURS, ROOT, Program

VIVANT = str(ROOT / "build/vivant")
GIB = 2**30
SETTLED = 0.3  # part of a training after which nothing new is allocated: pictures and checkpoints have been written


def step(planes, rays):
    """Peak of a process that makes a step of W1, its arena, and the lower bound of that."""
    program = Program(OURS)
    program.load({"workload": "scene step", "planes": planes, "rays": rays, "samples": 128})
    program.run(2)
    peak, (arena, bound) = program.peak_bytes(), program.memory()
    program.close()
    return peak, arena, bound


def reports_of(command):
    """The memory that a command of ours reports while it works, by stage: {stage: [(step, bytes)]}."""
    process = subprocess.run([VIVANT, *command, "--progress", "json"], capture_output=True, text=True, check=False)
    if process.returncode:
        raise SystemExit(f"vivant {' '.join(command)} failed: {process.stderr.strip()}")
    found = {}
    for line in (process.stdout + process.stderr).splitlines():
        if line.startswith("{"):
            row = json.loads(line)
            found.setdefault(row["stage"], []).append((row["step"], row["memory_bytes"]))
    return found


def capture_in(folder):
    subprocess.run([VIVANT, "synth", "-o", f"{folder}/capture", "--frames", "9", "--size", "96x72", "--progress", "none"],
                   check=True, stdout=subprocess.DEVNULL)
    return f"{folder}/capture"


def stylised_frame(folder, capture, size):
    """The peak while a frame is rendered and painted; what the fields have learnt does not matter."""
    settings = ["scene.steps=2", "human.steps=2", "features.steps=1", "style.steps=1", "training.preview_every=0"]
    run = f"{folder}/run"
    reports_of(["train", capture, "--run", run, "--preset", "demo", *[x for s in settings for x in ("--set", s)]])
    command = [VIVANT, "render", run, "--views", "first", "--size", size, "--style",
               str(ROOT / "assets/styles/woodblock.jpg"), "-o", f"{folder}/pictures", "--progress", "none"]
    timed = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stdout=2);" \
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    output = subprocess.run(["python3", "-c", timed, *command], check=True, stdout=subprocess.PIPE, text=True).stdout
    return 1024 * int(output)


def growth(folder, capture, steps):
    """Bytes by which a small training grows, by stage, from its settled state to its end."""
    settings = [f"scene.steps={steps}", f"human.steps={steps}", "features.steps=0", "style.steps=0",
                "training.preview_every=50", "training.checkpoint_every=50", "training.report_every=5",
                "scene.plane_size=32", "scene.rays=128", "scene.samples=16", "human.plane_size=32", "human.rays=64",
                "human.samples=16", "human.unet_widths=[16,32]"]
    found = reports_of(["train", capture, "--run", f"{folder}/long", "--preset", "demo",
                        *[x for s in settings for x in ("--set", s)]])
    rows = []
    for stage in ("scene", "human"):
        early = max(size for at, size in found[stage] if at <= SETTLED * steps)
        late = max(size for at, size in found[stage] if at > (1 - SETTLED) * steps)
        rows.append((stage, early, late))
    return rows


def main():
    parser = argparse.ArgumentParser(prog="scripts/measure-memory", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller sizes: W1s, a 480x270 frame, 300 steps")
    parser.add_argument("--json", metavar="FILE", help="also write the figures to a file")
    options = parser.parse_args()
    rows = []

    def row(what, measured, target):
        rows.append({"what": what, "bytes": measured, "target_bytes": target})
        limit = "" if target is None else f"{target / GIB:.3f}"
        print(f"| {what} | {measured / GIB:.3f} | {limit} |", flush=True)

    print("| memory of | GiB | at most |\n|---|---|---|")
    planes, rays = (128, 1024) if options.quick else (256, 4096)
    peak, arena, bound = step(planes, rays)
    name = f"scene step on {planes}x{planes} planes, {rays} rays x 128"
    row(f"{name}: process", peak, 3 * GIB)
    row(f"{name}: arena", arena, 3 * GIB)
    row(f"{name}: alive at one time", bound, None)
    size, steps = ("480x270", 300) if options.quick else ("1920x1080", 1000)
    with tempfile.TemporaryDirectory() as folder:
        capture = capture_in(folder)
        row(f"stylised frame {size}: process", stylised_frame(folder, capture, size), 4 * GIB)
        for stage, early, late in growth(folder, capture, steps):
            row(f"{steps} steps of the {stage}, first {SETTLED:.0%}", early, None)
            row(f"{steps} steps of the {stage}, last {SETTLED:.0%}", late, early + 2**24)
    if options.json:
        Path(options.json).write_text(json.dumps({"rows": rows}, indent=1) + "\n")
    too_large = [row["what"] for row in rows if row["target_bytes"] is not None and row["bytes"] > row["target_bytes"]]
    if too_large:
        raise SystemExit("more than it should be: " + "; ".join(too_large))


if __name__ == "__main__":
    main()
