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
    label: str  # in the table: the program, with the version of a framework, and its form
    in_bf16: bool = False


def debian_version(package):
    shown = subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], check=True, capture_output=True, text=True)
    return shown.stdout.partition("+")[0]


def framework(name, number, python=sys.executable, form="", in_bf16=False):
    arguments = ["rewritten"] if form == "(rewritten)" else []
    command = (python, str(HERE / f"peer_{name}.py"), *arguments)
    return Peer(command, f"{name} {number} {form}".strip(), in_bf16)


def library(name, *arguments, in_bf16=False):
    command = (str(ROOT / "build/bench" / f"peer_{name.lower()}"), *arguments)
    return Peer(command, " ".join([name, *(f"({argument})" for argument in arguments)]), in_bf16)


TORCH = framework("torch", version("torch"), in_bf16=True)
DEBIAN_TORCH = framework("torch", debian_version("python3-torch"), "/usr/bin/python3", "(Debian)", in_bf16=True)
JAX = framework("jax", version("jax"))
FRAMEWORKS = [TORCH, DEBIAN_TORCH, JAX]
REWRITTEN = [framework("torch", version("torch"), form="(rewritten)", in_bf16=True),
             framework("jax", version("jax"), form="(rewritten)")]
ONEDNN, WINOGRAD, OPENBLAS = library("oneDNN", in_bf16=True), library("oneDNN", "Winograd"), library("OpenBLAS")
