"""Paintings made of strokes and dots: impasto swirls, pointillism, ink wash."""

import numpy as np

from painting import (SIZE, blur, lit_relief, noise, palette, pixel_grid, ramp, step, stroke)


def impasto(random: np.random.Generator) -> np.ndarray:
    """Thick swirling strokes: an amber sky with whirling suns over violet hills."""
    x, y = pixel_grid()
    suns = [(130, 120, 62), (330, 90, 46), (430, 210, 36), (235, 235, 34)]
    horizon = 345 + 26 * np.sin(x / 70) + 12 * np.sin(x / 29 + 1)
    sky = palette("16305e", "1f4f8c", "2f7fb0", "7cb8c4", "e9d38a")
    tone = 0.42 + 0.3 * noise((SIZE, SIZE), 4, random) + 0.14 * y / SIZE
    picture = ramp(sky, tone)
    flow_x, flow_y = np.ones((SIZE, SIZE)), 0.35 * np.sin(x / 55 + 0.02 * y)
    for sun_x, sun_y, radius in suns:
        dx, dy = x - sun_x, y - sun_y
        distance = np.hypot(dx, dy)
        pull = 4 * np.exp(-(distance / (1.7 * radius)) ** 2)
        flow_x, flow_y = flow_x - pull * dy / (distance + 1), flow_y + pull * dx / (distance + 1)
        glow = np.exp(-(distance / radius) ** 2)
        rings = 0.5 + 0.5 * np.cos(distance / radius * 7)
        sun = ramp(palette("f4a62a", "f7c948", "fff2b0"), glow * (0.6 + 0.5 * rings))
        picture += (np.clip(1.35 * glow, 0, 1) * (0.55 + 0.45 * rings))[..., None] * (sun - picture)
    ground = step(-3, 3, y - horizon)
    hills = ramp(palette("3a2350", "5b3a78", "27583f", "8aa04a", "d98c3a"),
                 0.45 + 0.35 * noise((SIZE, SIZE), 6, random) + 0.25 * np.sin((y - horizon) / 21 + x / 90))
    picture += ground[..., None] * (hills - picture)
    flow_y = np.where(ground > 0.5, 0.45 * np.cos(x / 60 + y / 40), flow_y)
    flow_x = np.where(ground > 0.5, 1.0, flow_x)

    canvas, relief = picture * 0.75, np.zeros((SIZE, SIZE))
    angle = np.arctan2(flow_y, flow_x)
    for count, length, width in ((2600, 44, 11), (5200, 30, 7), (4200, 20, 4.5)):
        for _ in range(count):
            px, py = random.uniform(0, SIZE, 2)
            row, column = int(py), int(px)
            colour = np.clip(picture[row, column] + random.normal(0, 0.055, 3) + random.normal(0, 0.05), 0, 1)
            stroke(canvas, relief, px, py, angle[row, column] + random.normal(0, 0.1),
                   length * random.uniform(0.7, 1.3), width * random.uniform(0.7, 1.3), colour,
                   random.normal(0, 0.25), random)
    return lit_relief(canvas, relief, 0.75)


def pointillism(random: np.random.Generator) -> np.ndarray:
    """Dots of pure colour: a harbour at noon with two sails and their reflections."""
    x, y = pixel_grid()
    picture = ramp(palette("f6c5a0", "f7e3b5", "a9d6e5", "4f8fc8"), 1 - y / 250 + 0.08 * noise((SIZE, SIZE), 5, random))
    water = step(-2, 2, y - 250)
    ripple = np.sin(y / 4.5 + 2.5 * np.sin(x / 37)) * 0.12
    sea = ramp(palette("f2d6a2", "5fb3b3", "2a74a8", "1c4a86"), (y - 250) / 262 + ripple)
    picture += water[..., None] * (sea - picture)
    coast = step(-2, 2, y - (215 + 14 * np.sin(x / 45) + 10 * np.sin(x / 17))) * (1 - water) * step(0, 3, x - 250)
    picture += coast[..., None] * (np.array([0.47, 0.42, 0.62]) - picture)
    for mast, deck, height, tint in ((165, 330, 235, "e8743b"), (352, 292, 150, "f7f0d8")):
        for mirrored in (1, -0.45):
            up = (deck - y) * mirrored
            if mirrored < 0:
                up = (y - deck - 14) / 0.62
            wide = (height - up) * 0.36
            sail = step(-1, 1, np.minimum(np.minimum(up - 8, height - up), np.minimum(x - mast + 1, mast + wide - x)))
            jib = step(-1, 1, np.minimum(np.minimum(up - 8, 0.8 * height - up),
                                         np.minimum(mast - 5 - x, x - mast + 0.75 * wide - 2)))
            strength = 0.95 if mirrored > 0 else 0.5
            shade = palette(tint)[0] * (0.8 + 0.2 * np.clip((x - mast) / 40, -1, 1))[..., None]
            picture += (strength * sail)[..., None] * (shade - picture)
            picture += (strength * jib)[..., None] * (palette("fbe6a8")[0] - picture)
        hull = step(-1, 1, np.minimum(14 - np.abs(y - deck - 4), 0.33 * height - np.abs(x - mast - 8) - 0.5 * np.abs(y - deck)))
        picture += hull[..., None] * (palette("5a2a3c")[0] - picture)

    canvas = np.ones((SIZE, SIZE, 3)) * palette("efe4cf")[0]
    pure = palette("f4d03f", "e74c3c", "2e86c1", "27ae60", "8e44ad", "f39c12", "fdfefe", "1f3a6e")
    for radius, count in ((4.6, 9000), (3.4, 16000), (2.4, 9000)):
        for px, py in random.uniform(0, SIZE, (count, 2)):
            target = picture[int(py), int(px)]
            kind = random.uniform()
            if kind < 0.72:
                colour = target + random.normal(0, 0.07, 3)
            else:  # a pure pigment that is not too far, or the complement in the shade
                distance = ((pure - target) ** 2).sum(axis=1)
                colour = pure[np.argsort(distance)[0 if kind < 0.9 else 2]]
            dot(canvas, px, py, radius * random.uniform(0.8, 1.15), np.clip(colour, 0, 1))
    return canvas


def dot(canvas: np.ndarray, x: float, y: float, radius: float, colour: np.ndarray) -> None:
    left, right = max(0, int(x - radius - 1)), min(SIZE, int(x + radius + 2))
    top, bottom = max(0, int(y - radius - 1)), min(SIZE, int(y + radius + 2))
    rows, columns = np.mgrid[top:bottom, left:right]
    inside = step(-0.7, 0.7, radius - np.hypot(columns + 0.5 - x, rows + 0.5 - y))[..., None]
    canvas[top:bottom, left:right] += 0.93 * inside * (colour - canvas[top:bottom, left:right])


def ink_wash(random: np.random.Generator) -> np.ndarray:
    """Black ink and water on warm paper: mountains in mist, reeds, a red sun."""
    x, y = pixel_grid()
    fibre = noise((SIZE, SIZE), 150, random, 2) * 0.02 + noise((SIZE, SIZE), 8, random) * 0.02
    ink = np.zeros((SIZE, SIZE))
    for layer, (base, height, strength) in enumerate(((210, 120, 0.26), (275, 125, 0.42), (345, 105, 0.66))):
        profile = noise((1, SIZE), 3.2 + 1.3 * layer, random, 5)[0]
        ridge = base - height * np.abs(profile)[None, :] * 1.5
        depth = y - ridge + 5 * noise((SIZE, SIZE), 40, random, 2)
        wash = step(0, 2.5, depth) * np.exp(-np.clip(depth, 0, None) / (46 + 10 * layer))
        texture = 1 + 0.55 * noise((SIZE, SIZE), 26, random) + 0.35 * np.sin(depth / 5 + 5 * noise((SIZE, SIZE), 9, random))
        rim = np.exp(-((depth - 2) / 2.2) ** 2) * (0.55 + 0.45 * noise((SIZE, SIZE), 14, random))
        ink = np.maximum(ink, np.clip(strength * (wash * texture + 0.6 * rim), 0, 1))
    lake = step(372, 420, y)
    ink = np.maximum(ink, lake * 0.2 * step(0.35, 0.75, np.sin(y / 5.5 + 3 * noise((SIZE, SIZE), 5, random)) * 0.5 + 0.5))
    canvas = np.repeat((1 - ink)[..., None], 3, axis=2)
    for _ in range(90):  # reeds: long thin strokes, darker in front
        foot = random.uniform(10, 250) if random.uniform() < 0.75 else random.uniform(380, 505)
        length = random.uniform(60, 190)
        lean = random.normal(0.1, 0.22)
        dark = random.uniform(0.02, 0.35)
        stroke(canvas, None, foot + 0.5 * length * np.sin(lean), 512 - 0.45 * length, np.pi / 2 + lean, length,
               random.uniform(2.0, 5.0), np.full(3, dark), random.normal(0, 0.5), random, 0.85)
    for _ in range(28):  # splashes
        px, py = random.uniform(0, SIZE), random.uniform(300, SIZE)
        dot(canvas, px, py, random.uniform(0.8, 3.6), np.full(3, 0.12))
    ink = np.clip(1 - blur(canvas[..., 0], 0.8) + 0.25 * blur(1 - canvas[..., 0], 6), 0, 1)
    paper = palette("f1e6cf")[0] * (1 + fibre)[..., None]
    picture = paper * (1 - ink[..., None]) + palette("1b1d26")[0] * ink[..., None]
    sun = step(-1.5, 1.5, 42 - np.hypot(x - 372, y - 104)) * (0.82 + 0.18 * noise((SIZE, SIZE), 30, random))
    return picture * (1 - sun[..., None] * (1 - palette("d1402f")[0]))
