"""The programs that take part beside ours."""

import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from program import ROOT

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Peer:
    command: tuple
    label: str  # in the table: the program, with the release of a framework, and its form
    in_bf16: bool = False


def debian_release(package):
    """Empty where it is not installed."""
    shown = subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], check=False, capture_output=True, text=True)
    return shown.stdout.partition("+")[0]


def labelled(*words, notes=()):
    return " ".join([*words, *(f"({note})" for note in notes)])


def framework(name, *arguments, in_bf16=False):
    command = (sys.executable, str(HERE / f"peer_{name}.py"), *arguments)
    return Peer(command, labelled(name, version(name), notes=arguments), in_bf16)


def library(name, *arguments, in_bf16=False):
    command = (str(ROOT / "build/bench" / f"peer_{name.lower()}"), *arguments)
    return Peer(command, labelled(name, notes=arguments), in_bf16)


TORCH = framework("torch", in_bf16=True)
DEBIAN_TORCH = Peer(("/usr/bin/python3", str(HERE / "peer_torch.py")),
                    labelled("torch", debian_release("python3-torch"), notes=["Debian"]), in_bf16=True)
JAX = framework("jax")
FRAMEWORKS = [TORCH, DEBIAN_TORCH, JAX]
REWRITTEN = [framework("torch", "rewritten", in_bf16=True), framework("jax", "rewritten")]
ONEDNN, WINOGRAD, OPENBLAS = library("oneDNN", in_bf16=True), library("oneDNN", "Winograd"), library("OpenBLAS")
