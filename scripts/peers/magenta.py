"""Paints pictures with Magenta's arbitrary style transfer (Ghiasi et al. 2017), quantised, through onnxruntime.

The networks have fixed sizes: the painting is brought to 256x256, pictures to 384x384 and back.
"""

import argparse
from pathlib import Path

import numpy as np
import onnxruntime
from PIL import Image

STYLE_SIDE, CONTENT_SIDE = 256, 384
PICTURES = {".png", ".jpg"}


def read(picture: Image.Image, side: int) -> np.ndarray:
    small = picture.convert("RGB").resize((side, side), Image.Resampling.LANCZOS)
    return np.asarray(small, np.float32)[None] / 255


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", type=Path, help="folder of the .onnx files")
    parser.add_argument("frames", type=Path, help="folder of pictures")
    parser.add_argument("painting", type=Path)
    parser.add_argument("output", type=Path, help="folder for the painted pictures")
    arguments = parser.parse_args()

    frames = sorted(path for path in arguments.frames.iterdir() if path.suffix in PICTURES)
    if not frames:
        parser.error(f"{arguments.frames} holds no pictures (.png, .jpg)")
    predict, transform = (onnxruntime.InferenceSession(arguments.models / f"arbitrary_{name}.onnx",
                                                       providers=["CPUExecutionProvider"])
                          for name in ("predict", "transform"))
    (style,) = predict.run(None, {predict.get_inputs()[0].name: read(Image.open(arguments.painting), STYLE_SIDE)})
    content_input, style_input = (entry.name for entry in transform.get_inputs())
    arguments.output.mkdir(parents=True, exist_ok=True)
    for path in frames:
        picture = Image.open(path)
        (painted,) = transform.run(None, {content_input: read(picture, CONTENT_SIDE), style_input: style})
        pixels = np.round(np.clip(painted[0], 0, 1) * 255).astype(np.uint8)
        Image.fromarray(pixels).resize(picture.size, Image.Resampling.LANCZOS).save(
            arguments.output / f"{path.stem}.png")


if __name__ == "__main__":
    main()
