"""Paintings made of shapes: cubist facets, woodblock waves, mosaic, paper cut."""

import numpy as np

from painting import SIZE, blur, noise, palette, pixel_grid, ramp, step


def _nearest(points: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the nearest point and the distance to the border between the nearest two."""
    distance = np.hypot(x[..., None] - points[:, 0], y[..., None] - points[:, 1])
    order = np.argpartition(distance, 1, axis=-1)[..., :2]
    two = np.take_along_axis(distance, order, axis=-1)
    first = np.where(two[..., 0] <= two[..., 1], order[..., 0], order[..., 1])
    return first, np.abs(two[..., 1] - two[..., 0])


def cubist(random: np.random.Generator) -> np.ndarray:
    """Overlapping facets, each shaded from one edge: a still life of ochres, greys and blues."""
    x, y = pixel_grid()
    colours = palette("c9a06a", "8c6a43", "e6d2a8", "5a6f7c", "2f4858", "b5533c", "3d3a36", "9fb0a8", "d98e4a")
    picture = ramp(palette("7d7460", "b9a681", "5d6a6e"), 0.5 + 0.5 * noise((SIZE, SIZE), 3, random))
    for index in range(95):
        centre = random.uniform(0, SIZE, 2)
        scale = 190 * (1 - index / 130) * random.uniform(0.5, 1.1)
        turns = np.sort(random.uniform(0, 2 * np.pi, random.integers(3, 5)))
        edge = np.full((SIZE, SIZE), 1e9)
        for turn in turns:  # a convex facet: the common part of half planes
            reach = scale * random.uniform(0.25, 0.6)
            edge = np.minimum(edge, reach - (x - centre[0]) * np.cos(turn) - (y - centre[1]) * np.sin(turn))
        edge = np.minimum(edge, 0.8 * scale - np.hypot(x - centre[0], y - centre[1]))
        tilt = random.uniform(0, 2 * np.pi)
        shade = ((x - centre[0]) * np.cos(tilt) + (y - centre[1]) * np.sin(tilt)) / scale
        colour = colours[random.integers(len(colours))] * (0.9 + 0.55 * shade[..., None])
        brush = 1 + 0.1 * np.sin((x * np.sin(tilt) - y * np.cos(tilt)) / 2.3 + 4 * noise((SIZE, SIZE), 12, random, 1))
        alpha = 0.86 * step(0, 1.6, edge)
        picture += alpha[..., None] * (np.clip(colour * brush[..., None], 0, 1) - picture)
        line = np.exp(-((edge - 1.2) / 1.5) ** 2) * (0.6 + 0.4 * random.uniform())
        picture *= 1 - 0.75 * line[..., None]
    grain = noise((SIZE, SIZE), 120, random, 2)
    return np.clip(picture * (1 + 0.09 * grain[..., None]), 0, 1)


def woodblock(random: np.random.Generator) -> np.ndarray:
    """Flat printed colours with dark outlines: rows of rolling waves with foam claws under a banded dusk."""
    x, y = pixel_grid()
    picture = ramp(palette("d9694a", "eaa46c", "f2d9a7", "e9dfc0"), np.floor((y / 250) * 9) / 9)
    disc = step(-1, 1, 58 - np.hypot(x - 350, y - 120))
    picture += disc[..., None] * (palette("f6efd9")[0] - picture)
    cone = step(-1, 1, y - (120 + 0.62 * np.abs(x - 150) + 6 * np.sin(x / 9)))
    snow = step(-1, 1, 172 + 9 * np.sin(x / 7.5) - y)
    picture += cone[..., None] * (np.where(snow[..., None] > 0.5, palette("f3eee0")[0], palette("53687e")[0]) - picture)
    ink = palette("14263f")[0]
    blues = palette("1f3f6e", "2f5f94", "4a86b4", "7fb2cb", "b9d6d8")
    for row in range(7):
        base, period = 232 + 44 * row, 118 + 16 * row
        shift = random.uniform(0, period)
        phase = ((x + shift) / period) % 1
        swell = (28 + 5 * row) * (np.abs(np.sin(np.pi * phase)) ** 0.7 + 0.35 * np.sin(2 * np.pi * phase + 0.8))
        crest = base - swell + 3 * np.sin(x / 6.5) * step(0.3, 0.6, phase)
        depth = y - crest
        body = step(-0.8, 0.8, depth)
        stripe = np.floor(np.clip(depth / (11 + row) + 0.9 * np.sin(2 * np.pi * phase), 0, 4.99)).astype(int)
        colour = blues[4 - stripe] if row % 2 == 0 else blues[np.clip(3 - stripe, 0, 4)]
        picture += body[..., None] * (colour - picture)
        within = (depth / (11 + row) + 0.9 * np.sin(2 * np.pi * phase)) % 1
        line = body * (1 - step(0.07, 0.14, np.minimum(within, 1 - within))) * (depth < 5 * (11 + row))
        picture += (0.55 * line)[..., None] * (ink - picture)
        lobes = 6.5 + 4.5 * np.abs(np.sin(x / 7 + 0.6 * row)) + 2.5 * np.abs(np.sin(x / 2.9))
        foam = step(-0.7, 0.7, lobes - depth) * step(-4, -3, depth)
        picture += foam[..., None] * (palette("f4f0e2")[0] - picture)
        outline = np.exp(-((depth + 2.2) / 1.5) ** 2) + 0.9 * np.exp(-((depth - lobes - 1) / 1.2) ** 2)
        picture += np.clip(outline, 0, 1)[..., None] * (ink - picture)
    for _ in range(150):  # spray
        px, py = random.uniform(0, SIZE), random.uniform(170, 420)
        drop = step(-0.7, 0.7, random.uniform(1, 2.6) - np.hypot(x - px, y - py))
        picture += drop[..., None] * (palette("f4f0e2")[0] - picture)
    grain = np.sin(y / 1.6 + 6 * noise((SIZE, SIZE), 3, random)) * 0.018 + 0.03 * noise((SIZE, SIZE), 100, random, 2)
    return np.clip(picture * (1 + grain[..., None]), 0, 1)


def mosaic(random: np.random.Generator) -> np.ndarray:
    """Glass and gold tiles in curving rows: a peacock-coloured medallion."""
    x, y = pixel_grid()
    dx, dy = x - 256, y - 256
    radius, angle = np.hypot(dx, dy), np.arctan2(dy, dx)
    points, colours = [], []
    rings = palette("0b3c5d", "117a8b", "1fa187", "e2b842", "c1440e", "7b1e3a", "2b1a4a", "1d5c8f", "e8d9b0")
    for ring in range(34):
        distance = 6 + 11.2 * ring
        count = max(5, int(2 * np.pi * distance / 11.5))
        turn = random.uniform(0, 2 * np.pi)
        for tile in range(count):
            theta = turn + 2 * np.pi * tile / count
            petal = distance * (1 + 0.16 * np.cos(8 * theta))
            band = petal / 44 + 0.5 * np.cos(16 * theta) * (distance > 120)
            colour = rings[int(band) % len(rings)]
            if random.uniform() < 0.13:
                colour = palette("e9c65b")[0]  # gold
            points.append((256 + distance * np.cos(theta) + random.normal(0, 0.8),
                           256 + distance * np.sin(theta) + random.normal(0, 0.8)))
            colours.append(np.clip(colour * random.uniform(0.72, 1.3) + random.normal(0, 0.025, 3), 0, 1))
    points, colours = np.array(points), np.array(colours)
    visible = (np.abs(points - 256) < 270).all(axis=1)
    points, colours = points[visible], colours[visible]
    tilt = random.normal(0, 1, (len(points), 2))
    picture = np.zeros((SIZE, SIZE, 3))
    for top in range(0, SIZE, 16):  # in strips, to bound memory
        rows = slice(top, top + 16)
        tile, border = _nearest(points, x[rows], y[rows])
        lean = ((x[rows] - points[tile, 0]) * tilt[tile, 0] + (y[rows] - points[tile, 1]) * tilt[tile, 1]) / 14
        glass = colours[tile] * (1 + 0.28 * np.clip(lean, -1, 1))[..., None]
        grout = 1 - step(1.0, 2.6, border)
        bevel = step(2.6, 4.2, border) - step(4.2, 5.8, border)
        glass = glass + 0.1 * bevel[..., None]
        picture[rows] = glass * (1 - grout[..., None]) + palette("2a2622")[0] * grout[..., None]
    sheen = 1 + 0.14 * np.cos(angle - 0.8) * np.exp(-radius / 400) + 0.05 * noise((SIZE, SIZE), 60, random, 2)
    return np.clip(picture * sheen[..., None], 0, 1)


def paper_cut(random: np.random.Generator) -> np.ndarray:
    """Large leaves cut from painted paper, with soft shadows: coral, teal, mustard and ink."""
    x, y = pixel_grid()
    grounds = palette("f2c14e", "e4572e", "17bebb", "f7ede2", "2e4057", "f28482")
    cell_x, cell_y = (x // 171).astype(int), (y // 171).astype(int)
    order = random.permutation(9) % len(grounds)
    picture = grounds[order[np.minimum(cell_x + 3 * cell_y, 8)]] * (1 + 0.05 * noise((SIZE, SIZE), 30, random))[..., None]
    leaves = palette("17594a", "e4572e", "2e4057", "f7ede2", "17bebb", "f2c14e", "8d2b4c")
    for index in range(26):
        centre = random.uniform(20, SIZE - 20, 2)
        size, turn = random.uniform(48, 105), random.uniform(0, 2 * np.pi)
        lobes = random.integers(4, 9)
        dx, dy = x - centre[0], y - centre[1]
        along = dx * np.cos(turn) + dy * np.sin(turn)
        across = dy * np.cos(turn) - dx * np.sin(turn)
        reach = np.clip(1 - (along / size) ** 2, 0, 1)
        finger = 0.5 + 0.5 * np.cos(lobes * np.pi * along / size + 0.5 * np.abs(across) / 6)
        edge = size * 0.62 * np.sqrt(reach) * (0.3 + 0.7 * finger ** 0.6) - np.abs(across)
        edge = np.where(np.abs(along) < size, edge, -20)
        shadow = blur(step(-1, 1, np.roll(edge, (5, 4), axis=(0, 1))), 4)
        picture *= 1 - 0.38 * shadow[..., None]
        paint = 1 + 0.09 * np.sin(along / 2.6 + 3 * noise((SIZE, SIZE), 10, random, 1)) + 0.05 * noise((SIZE, SIZE), 60, random, 1)
        colour = leaves[index % len(leaves)] * paint[..., None]
        picture += step(-0.8, 0.8, edge)[..., None] * (colour - picture)
    return np.clip(picture, 0, 1)
