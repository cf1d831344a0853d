"""The commands that scripts/compare-peers sends to every program, and tensors in safetensors files."""

import json
import struct
import sys
import time

import numpy as np

NEAR, FAR = 1.2, 3.2  # depths between which rays are sampled
POOLED_BEFORE = {"2_1", "3_1", "4_1", "5_1"}  # layers of VGG-19
TYPES = {"F32": np.float32, "F64": np.float64, "I32": np.int32, "U8": np.uint8}


def read_tensors(path):
    with open(path, "rb") as file:
        header = json.loads(file.read(struct.unpack("<Q", file.read(8))[0]))
        data = file.read()
    header.pop("__metadata__", None)
    return {
        name: np.frombuffer(data, TYPES[entry["dtype"]], int(np.prod(entry["shape"])), entry["data_offsets"][0])
        .reshape(entry["shape"])
        .copy()
        for name, entry in header.items()
    }


def write_tensors(path, tensors):
    header, offset = {}, 0
    arrays = {name: np.ascontiguousarray(tensor, np.float64) for name, tensor in tensors.items()}
    for name, array in arrays.items():
        header[name] = {"dtype": "F64", "shape": array.shape, "data_offsets": [offset, offset + array.nbytes]}
        offset += array.nbytes
    text = json.dumps(header).encode()
    with open(path, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        for array in arrays.values():
            file.write(array.data)


def vgg_weights(path):
    """Layers up to relu5_1 as (name, weights [out, in, 3, 3], bias [out])."""
    file = read_tensors(path)
    names = ["1_1", "1_2", "2_1", "2_2", "3_1", "3_2", "3_3", "3_4", "4_1", "4_2", "4_3", "4_4", "5_1"]
    return [
        (name, file[f"conv{name}.codebook"][file[f"conv{name}.weight_index"]], file[f"conv{name}.bias"])
        for name in names
    ]


def vgg_input():
    """The published network reads BGR in 0..255 minus its mean colour: matrix [3, 3] and shift [3] for RGB."""
    return 255 * np.eye(3)[:, ::-1].copy(), -np.array([103.939, 116.779, 123.68])


def serve(load):
    """Answers commands until standard input ends. `load(request)` returns (run, results): functions that do
    the work once and wait, and that give what was computed as numpy arrays by name."""
    run = results = None
    for line in sys.stdin:
        command, _, argument = line.strip().partition(" ")
        try:
            if command == "load":
                run = results = None
                run, results = load(json.loads(argument))
                answer = "ready"
            elif command == "run":
                answer = "seconds"
                for _ in range(int(argument)):
                    start = time.perf_counter()
                    run()
                    answer += f" {time.perf_counter() - start:.9f}"
            elif command == "results":
                write_tensors(argument, results())
                answer = "written"
            else:
                answer = f"error unknown command {command}"
        except Exception as error:  # one line for the driver, which goes on without this peer
            answer = "error " + f"{type(error).__name__}: {error}".replace("\n", " ")
        print(answer, flush=True)
