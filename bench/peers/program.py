"""Programs that answer the commands of protocol.py and bench/workloads/main.cpp, and how their times are taken."""

import json
import math
import os
import statistics
import subprocess
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
OURS = [str(ROOT / "build/bench/workloads")]
THREADS = 2
SLOW_SECONDS = 3  # for one run: then three runs are enough
TURN_SECONDS, PAUSE_SECONDS = 0.05, 0.02  # waiting threads of a peer spin for a while: others wait for them


class Program:
    """A process that answers commands."""

    def __init__(self, command, threads=THREADS):
        environment = {
            **os.environ, "OMP_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads),
            "POCL_MAX_PTHREAD_COUNT": str(threads), "JAX_PLATFORMS": "cpu", "TF_CPP_MIN_LOG_LEVEL": "3",
        }
        self.process = subprocess.Popen(
            command, env=environment, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def ask(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().strip()
        if not answer or answer.startswith("error"):
            raise RuntimeError(answer or "the program ended")
        return answer

    def load(self, request):
        self.ask("load " + json.dumps(request))

    def run(self, times):
        return [float(word) for word in self.ask(f"run {times}").split()[1:]]

    def launch_share(self, seconds):
        """Kernels in a run, and the part of its time that their launches take. Of our program alone."""
        count, cost = self.ask("launches").split()[1:]
        return int(count), int(count) * float(cost) / seconds

    def memory(self):
        """Bytes of the arena, and the most that is alive at one time. Of our program alone."""
        return [int(word) for word in self.ask("memory").split()[1:]]

    def peak_bytes(self):
        """Of the process since its start."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return 1024 * int(line.split()[1])

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def spread(times):
    """Half of the middle half, relative to the median."""
    low, _, high = statistics.quantiles(times, n=4)
    return (high - low) / 2 / statistics.median(times)


def measure(programs, rounds):
    """Seconds of every program, which take turns."""
    first = {name: program.run(1)[0] for name, program in programs.items()}
    slow = max(first.values()) > SLOW_SECONDS
    times = {name: [seconds] if slow else [] for name, seconds in first.items()}
    names = list(programs)
    for turn in range(2 if slow else rounds):
        for name in names[turn % len(names):] + names[: turn % len(names)]:
            count = min(100, max(1, math.ceil(TURN_SECONDS / first[name])))
            time.sleep(PAUSE_SECONDS)
            times[name].append(statistics.median(programs[name].run(count)))
    return times
