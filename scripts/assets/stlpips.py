"""assets/stlpips.safetensors: the shift-tolerant LPIPS of Ghildyal and Liu (ECCV 2022), AlexNet form.

Convolutions and linear heads as the package trained them; the weights of convolutions in half precision, which moves
distances by less than a thousandth. The fixed blur filters and the input scaling are left out: they are constants of
the program.
"""

from pathlib import Path
from zipfile import ZipFile

import numpy as np

import safetensors_file
import torch_file

CONVOLUTIONS = {"conv1": "net.slice1.0", "conv2": "net.slice2.5", "conv3": "net.slice3.9", "conv4": "net.slice4.11",
                "conv5": "net.slice5.13"}
WEIGHTS_FILE = "stlpips_pytorch/weights/vST0.0/alex_shift_tolerant.pth"


def make(downloads: Path, output: Path) -> list[Path]:
    (path,) = downloads.glob("stlpips_pytorch-*.whl")
    with ZipFile(path) as wheel:
        stored = torch_file.read(wheel.read(WEIGHTS_FILE))
    tensors = {}
    for index, (name, source) in enumerate(CONVOLUTIONS.items()):
        tensors[name + ".weight"] = stored[source + ".weight"].astype(np.float16)
        tensors[name + ".bias"] = stored[source + ".bias"].astype(np.float32)
        tensors[f"linear{index + 1}"] = stored[f"lin{index}.model.1.weight"].reshape(-1).astype(np.float32)
    metadata = {
        "source": "PyPI stlpips_pytorch 0.0.2 (BSD 2-Clause), ST-LPIPS alex, shift tolerant",
        "layout": "conv<k>.weight [out,in,k,k], conv<k>.bias [out], linear<k> [out]: the weight of each channel's "
                  "squared difference",
    }
    path = output / "stlpips.safetensors"
    safetensors_file.write(path, tensors, metadata)
    return [path]
