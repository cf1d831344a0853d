"""Runs every workload in our program and in the others in turn and prints one table. See scripts/compare-peers."""

import argparse
import json
import math
import os
import statistics
import sys
import tempfile
from pathlib import Path

import numpy as np

from peers import TORCH
from program import OURS, ROOT, THREADS, Program, measure, spread
from protocol import read_tensors
from work import workloads

PEER_MODE = {"fp32": "fp32", "bf16x3": "fp32", "bf16": "bf16"}  # bf16x3 has the accuracy of fp32
SAME_WORK = {"fp32": 5e-3, "bf16": 0.1}  # largest error of a peer that computes the same


def results_of(program, folder):
    path = Path(folder) / "results.safetensors"
    program.ask(f"results {path}")
    tensors = read_tensors(path)
    path.unlink()
    return tensors


def error_of(found, truth):
    """The largest relative rms error of an output; all gradients together count as one."""
    difference, size = {}, {}
    for name, right in truth.items():
        kind = "gradient" if name.startswith("gradient of") else name
        difference[kind] = difference.get(kind, 0) + float(np.sum((found[name] - right) ** 2))
        size[kind] = size.get(kind, 0) + float(np.sum(right**2))
    return max(math.sqrt(difference[kind] / max(size[kind], 1e-30)) for kind in size)


def reference(request, folder):
    """What torch computes in fp64."""
    program = Program(TORCH.command)
    program.load({**request, "mode": "fp64"})
    program.run(1)
    truth = results_of(program, folder)
    program.close()
    return truth


def load_ours(program, work, request, folder):
    """Loads work into our program; its error, and what it should compute."""
    small = {**request, **work.checked_at}
    try:
        program.load(small)
        program.ask(f"inputs {request['inputs']}")
        truth = reference(small, folder)
        program.run(1)
        error = error_of(results_of(program, folder), truth)
        if work.checked_at:
            program.load(request)
        return error, truth
    except RuntimeError as error:
        raise SystemExit(f"our program failed in {work.name}: {error}") from error


def load_peer(peer, work, request, truth, folder):
    """A peer that has the work loaded, and its error; None when it cannot do this work."""
    program = Program(peer.command)
    try:
        program.load(request)
        program.run(1)
        error = error_of(results_of(program, folder), truth)
    except RuntimeError as reason:
        print(f"{peer.label} left out of {work.name}: {reason}", file=sys.stderr)
        program.close()
        return None
    if error > SAME_WORK[request["mode"]]:
        print(f"{peer.label} computes something else in {work.name}: error {error:.1e}", file=sys.stderr)
    return program, error


def compare(work, mode, ours, folder, rounds):
    """Rows of the table for one workload in one of our modes."""
    request = {**work.request, "mode": mode, "inputs": f"{folder}/inputs.safetensors",
               "vgg": str(ROOT / "assets/vgg19.safetensors")}
    programs, errors = {"ours": ours}, {}
    errors["ours"], truth = load_ours(ours, work, request, folder)
    for peer in work.peers:
        if PEER_MODE[mode] == "bf16" and not peer.in_bf16:
            continue
        loaded = load_peer(peer, work, {**request, "mode": PEER_MODE[mode]}, truth, folder)
        if loaded:
            programs[peer.label], errors[peer.label] = loaded
    del truth
    for name, sizes in work.ours.items():
        programs[name] = Program(OURS)
        other = {**request, **sizes, "inputs": f"{folder}/other.safetensors"}
        errors[name], _ = load_ours(programs[name], work, other, folder)
    times = measure(programs, rounds)
    ours_s = statistics.median(times["ours"])
    launches, launch_share = ours.launch_share(ours_s)
    for name, program in programs.items():
        if name != "ours":
            program.close()
    return [
        {
            "workload": work.name, "mode": mode, "ours_s": ours_s, "peer": name,
            "peer_s": statistics.median(times[name]), "error": errors["ours"], "ours_spread": spread(times["ours"]),
            "peer_spread": spread(times[name]), "peer_error": errors[name], "launches": launches,
            "launch_share": launch_share,
        }
        for name in programs if name != "ours"
    ]


HEADER = ["workload", "mode", "ours ms", "+-", "launches", "of time", "peer", "peer ms", "+-", "peer / ours", "error",
          "peer's error"]


def line_of(row):
    cells = [
        row["workload"], row["mode"], f"{1e3 * row['ours_s']:.2f}", f"{row['ours_spread']:.0%}",
        str(row["launches"]), f"{row['launch_share']:.2%}", row["peer"], f"{1e3 * row['peer_s']:.2f}",
        f"{row['peer_spread']:.0%}", f"{row['peer_s'] / row['ours_s']:.2f}", f"{row['error']:.1e}",
        f"{row['peer_error']:.1e}",
    ]
    return "| " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(prog="scripts/compare-peers", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few repetitions, small workloads alone")
    parser.add_argument("--only", help="groups of workloads, such as W1,W3: " +
                        ", ".join(dict.fromkeys(work.group for work in workloads())))
    parser.add_argument("--json", metavar="FILE", help="also write the rows to a file")
    options = parser.parse_args()
    chosen = [work for work in workloads() if work.quick or not options.quick]
    if options.only:
        groups = options.only.split(",")
        known = {work.group for work in workloads()}
        if set(groups) - known:
            parser.error(f"unknown workload: {', '.join(set(groups) - known)}; known are {', '.join(sorted(known))}")
        chosen = [work for work in workloads() if work.group in groups]
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:THREADS])
    rows = []
    print("| " + " | ".join(HEADER) + " |\n|" + "---|" * len(HEADER))
    ours = Program(OURS)
    with tempfile.TemporaryDirectory() as folder:
        for work in chosen:
            for mode in ours.ask("modes").split()[1:]:
                for row in compare(work, mode, ours, folder, 3 if options.quick else 9):
                    rows.append(row)
                    print(line_of(row), flush=True)
    ours.close()
    if options.json:
        Path(options.json).write_text(json.dumps({"rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
