"""assets/styles/: paintings that this project makes itself, so that they are free for every use (CC0)."""

from pathlib import Path

import numpy as np
from PIL import Image

import styles_shapes
import styles_strokes

PAINTINGS = {
    "impasto": styles_strokes.impasto, "pointillism": styles_strokes.pointillism, "ink_wash": styles_strokes.ink_wash,
    "cubist": styles_shapes.cubist, "woodblock": styles_shapes.woodblock, "mosaic": styles_shapes.mosaic,
    "paper_cut": styles_shapes.paper_cut,
}


def make(_downloads: Path, output: Path) -> list[Path]:
    (output / "styles").mkdir(exist_ok=True)
    paths = []
    for seed, (name, paint) in enumerate(PAINTINGS.items()):
        picture = np.clip(paint(np.random.default_rng(seed)), 0, 1)
        path = output / "styles" / f"{name}.jpg"
        Image.fromarray(np.rint(picture * 255).astype(np.uint8)).save(path, quality=92, subsampling=0)
        paths.append(path)
    return paths
