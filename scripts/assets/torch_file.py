"""Reads the tensors of an old-style torch.save file without torch and without running anything it names.

The file is four pickles (magic number, protocol version, machine facts, the dictionary), the list of storage
keys, then every storage as an element count and raw bytes. Only the three names that a tensor needs resolve,
each to a small stand-in of our own; any other name in the pickle is an error.
"""

import collections
import io
import pickle
import struct

import numpy as np

MAGIC_NUMBER = 0x1950A86A20F9469CFC6C
PROTOCOL_VERSION = 1001
STORAGE_TYPES = {"ByteStorage": np.dtype("u1"), "FloatStorage": np.dtype("<f4")}


class _Storage:
    def __init__(self, dtype: np.dtype, size: int):
        self.dtype, self.size, self.data = dtype, size, None


class _LazyTensor:
    def __init__(self, storage: _Storage, offset: int, shape: tuple, stride: tuple):
        self.storage, self.offset, self.shape, self.stride = storage, offset, shape, stride

    def array(self) -> np.ndarray:
        strides = [s * self.storage.dtype.itemsize for s in self.stride]
        if self.offset + sum((n - 1) * s for n, s in zip(self.shape, self.stride)) >= self.storage.size:
            raise ValueError("a tensor reaches beyond its storage")
        return np.lib.stride_tricks.as_strided(self.storage.data[self.offset:], self.shape, strides).copy()


def _rebuild_tensor(storage, offset, shape, stride, *_unused):
    return _LazyTensor(storage, offset, tuple(shape), tuple(stride))


class _RestrictedUnpickler(pickle.Unpickler):
    def __init__(self, file, storages: dict[str, _Storage]):
        super().__init__(file)
        self.storages = storages

    def find_class(self, module, name):
        if (module, name) == ("collections", "OrderedDict"):
            return collections.OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _rebuild_tensor
        if module == "torch" and name in STORAGE_TYPES:
            return STORAGE_TYPES[name]
        raise pickle.UnpicklingError(f"the file names {module}.{name}, which no tensor needs")

    def persistent_load(self, identifier):
        kind, dtype, key, _device, size, _view = identifier
        if kind != "storage":
            raise pickle.UnpicklingError(f"unknown persistent object {kind!r}")
        return self.storages.setdefault(key, _Storage(dtype, size))


def read(data: bytes) -> dict[str, np.ndarray]:
    file = io.BytesIO(data)
    storages: dict[str, _Storage] = {}

    def load():
        return _RestrictedUnpickler(file, storages).load()

    if load() != MAGIC_NUMBER or load() != PROTOCOL_VERSION:
        raise ValueError("not an old-style torch.save file")
    if not load()["little_endian"]:
        raise ValueError("the storages are big-endian")
    tensors = load()
    for key in load():
        storage = storages[key]
        (size,) = struct.unpack("<q", file.read(8))
        if size != storage.size:
            raise ValueError(f"storage {key} has {size} elements, its tensor says {storage.size}")
        storage.data = np.frombuffer(file.read(size * storage.dtype.itemsize), storage.dtype)
    return {name: tensor.array() for name, tensor in tensors.items()}
