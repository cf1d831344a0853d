"""What the procedural paintings share: noise, flow, colour and brush strokes. All in double precision, so that the
same seed gives the same picture on every machine."""

import numpy as np

SIZE = 512


def noise(shape: tuple[int, int], cells: float, random: np.random.Generator, octaves: int = 3) -> np.ndarray:
    """Smooth noise in about [-1,1]; `cells` features across the width."""
    height, width = shape
    total, weight, norm = np.zeros(shape), 1.0, 0.0
    for _ in range(octaves):
        grid = random.uniform(-1, 1, (int(cells * height / width) + 3, int(cells) + 3))
        y = np.arange(height)[:, None] * (cells / width)
        x = np.arange(width)[None, :] * (cells / width)
        row, column = np.floor(y).astype(int), np.floor(x).astype(int)
        v, u = y - row, x - column
        v, u = v * v * (3 - 2 * v), u * u * (3 - 2 * u)
        top = grid[row, column] * (1 - u) + grid[row, column + 1] * u
        bottom = grid[row + 1, column] * (1 - u) + grid[row + 1, column + 1] * u
        total += weight * (top * (1 - v) + bottom * v)
        norm, weight, cells = norm + weight, weight / 2, cells * 2.1
    return total / norm


def blur(image: np.ndarray, radius: float) -> np.ndarray:
    """Gaussian blur of [H,W] or [H,W,C], edges repeated."""
    reach = int(3 * radius) + 1
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / radius) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        pad = [(0, 0)] * image.ndim
        pad[axis] = (reach, reach)
        padded = np.pad(image, pad, mode="edge")
        length = image.shape[axis]
        image = sum(weight * padded.take(range(i, i + length), axis) for i, weight in enumerate(kernel))
    return image


def hex_colour(text: str) -> np.ndarray:
    return np.array([int(text[i:i + 2], 16) for i in (0, 2, 4)]) / 255


def palette(*colours: str) -> np.ndarray:
    return np.array([hex_colour(colour) for colour in colours])


def ramp(colours: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Colours along a palette, t in [0,1] -> [...,3]."""
    position = np.clip(t, 0, 1) * (len(colours) - 1)
    low = np.minimum(position.astype(int), len(colours) - 2)
    part = (position - low)[..., None]
    return colours[low] * (1 - part) + colours[low + 1] * part


def step(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def pixel_grid(height: int = SIZE, width: int = SIZE) -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[0:height, 0:width]
    return x + 0.5, y + 0.5


def stroke(canvas: np.ndarray, relief: np.ndarray | None, x: float, y: float, angle: float, length: float,
           width: float, colour: np.ndarray, bend: float, random: np.random.Generator, opacity: float = 0.95) -> None:
    """One bristly brush stroke around (x, y), bent along an arc; also raises the paint's relief."""
    reach = 0.5 * length + width + 2
    left, right = max(0, int(x - reach)), min(canvas.shape[1], int(x + reach) + 1)
    top, bottom = max(0, int(y - reach)), min(canvas.shape[0], int(y + reach) + 1)
    if left >= right or top >= bottom:
        return
    rows, columns = np.mgrid[top:bottom, left:right]
    dx, dy = columns + 0.5 - x, rows + 0.5 - y
    along = dx * np.cos(angle) + dy * np.sin(angle)
    across = dy * np.cos(angle) - dx * np.sin(angle) - bend * along * along / max(length, 1)
    bristles = random.uniform(-1, 1, 12)
    lane = np.clip((across / width + 0.5) * 11, 0, 10.999)
    index = lane.astype(int)
    bristle = bristles[index] * (1 - lane + index) + bristles[index + 1] * (lane - index)
    inside = step(0, 1.2, 0.5 * width - np.abs(across)) * step(0, 3, 0.5 * length * (1 + 0.12 * bristle) - np.abs(along))
    alpha = (opacity * inside)[..., None]
    tone = np.clip(colour * (1 + 0.1 * bristle[..., None]), 0, 1)
    region = canvas[top:bottom, left:right]
    region += alpha * (tone - region)
    if relief is not None:
        patch = relief[top:bottom, left:right]
        patch += alpha[..., 0] * (0.6 + 0.4 * bristle - 0.35 * (2 * across / width) ** 2 - patch)


def lit_relief(canvas: np.ndarray, relief: np.ndarray, strength: float) -> np.ndarray:
    """Shades thick paint from the upper left."""
    smooth = blur(relief, 0.7)
    slope = np.gradient(smooth, axis=0) + np.gradient(smooth, axis=1)
    return np.clip(canvas * (1 - strength * np.clip(slope, -0.8, 0.8)[..., None]), 0, 1)
