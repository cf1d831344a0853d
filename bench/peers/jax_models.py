"""The larger workloads in JAX. `t` holds inputs and parameters by name; images are [H, W, C]."""

import jax
import jax.numpy as jnp
from jax import lax
from jax.nn import relu

from protocol import FAR, NEAR, POOLED_BEFORE


def conv(x, w):
    return lax.conv_general_dilated(x[None], w, (1, 1), "SAME", dimension_numbers=("NHWC", "HWIO", "NHWC"))[0]


def max_pool(x):
    height, width, channels = x.shape
    return x.reshape(height // 2, 2, width // 2, 2, channels).max((1, 3))


def linear(t, name, x):
    return x @ t[name + ".weight"] + t[name + ".bias"]


def sample_planes(planes, points):
    """planes [3, H, W, C], points [N, 3] -> the product of the three bilinear samples, [N, C]."""
    size = planes.shape[1]
    product = 1
    for plane, (column, row) in zip(planes, [(0, 1), (0, 2), (1, 2)]):
        flat = plane.reshape(size * size, -1)
        x, y = (jnp.clip((points[:, axis] + 1) / 2 * size - 0.5, 0, size - 1) for axis in (column, row))
        left, top = (jnp.clip(jnp.floor(a), 0, size - 2).astype(jnp.int32) for a in (x, y))
        u, v = (x - left)[:, None], (y - top)[:, None]
        corner = lambda i, j: flat.at[(top + i) * size + left + j].get(mode="promise_in_bounds")
        above = corner(0, 0) * (1 - u) + corner(0, 1) * u
        below = corner(1, 0) * (1 - u) + corner(1, 1) * u
        product = product * (above * (1 - v) + below * v)
    return product


def render_weights(density, delta):
    passed = density * delta
    return jnp.exp(passed - jnp.cumsum(passed, 1)) * -jnp.expm1(-passed)


def encode(x, frequencies):
    parts = [x]
    for octave in range(frequencies):
        parts += [jnp.sin(2**octave * jnp.pi * x), jnp.cos(2**octave * jnp.pi * x)]
    return jnp.concatenate(parts, -1)


def vgg_network(image, layers, colours, last):
    x, found = image @ colours[0] + colours[1], {}
    for name, (w, b) in layers.items():
        x = relu(conv(max_pool(x) if name in POOLED_BEFORE else x, w) + b)
        found[name] = x
        if name == last:
            return found


def attend(t, queries):
    scores = jax.nn.softmax(0.1 * (queries @ t["keys"].T), -1)
    mean, square = jnp.split(scores @ jnp.concatenate([t["values"], t["values"] ** 2], 1), 2, -1)
    return jnp.sqrt(jnp.maximum(square - mean**2, 1e-12)) * queries + mean


def stylise(t, features, chunk):
    """[H, W, 256] -> [H, W, 3]; attention over `chunk` queries at a time, which divides their number."""
    height, width, channels = features.shape
    x = linear(t, "phi1", relu(linear(t, "phi0", features.reshape(-1, channels))))
    normal = (x - t["mean"]) / t["deviation"]
    if chunk and len(normal) > chunk:
        x = lax.map(lambda queries: attend(t, queries), normal.reshape(-1, chunk, channels))
    else:
        x = attend(t, normal)
    x = relu(linear(t, "psi1", relu(linear(t, "psi0", x.reshape(-1, channels)))))
    x = x.reshape(height, width, channels)
    for i in range(4):
        x = conv(x, t[f"decoder{i}.weight"]) + t[f"decoder{i}.bias"]
        x = relu(x) if i < 3 else x
    return x


def style_loss(t, layers, colours):
    image = stylise(t, t["features"], None)
    loss = 0
    for name, x in vgg_network(image, layers, colours, "5_1").items():
        if name in POOLED_BEFORE:
            deviation = jnp.sqrt(x.var((0, 1), ddof=1) + 1e-5)
            loss += jnp.mean((x.mean((0, 1)) - t[f"relu{name} mean"]) ** 2)
            loss += jnp.mean((deviation - t[f"relu{name} deviation"]) ** 2)
    return loss, {"image": image}


def u_net(t, name, x):
    def level(x, part):
        for half in ("first", "second"):
            layer = f"{name}.{part}.{half}"
            x = relu(conv(x, t[layer + ".weight"]) + t[layer + ".bias"])
        return x

    skips = []
    for i in range(4):
        x = level(max_pool(x) if i else x, f"down{i}")
        skips.append(x)
    for i in (2, 1, 0):
        height, width, _ = x.shape
        blocks = linear(t, f"{name}.up{i}.rise", x).reshape(height, width, 2, 2, -1)
        risen = blocks.transpose(0, 2, 1, 3, 4).reshape(2 * height, 2 * width, -1)
        x = level(jnp.concatenate([risen, skips[i]], -1), f"up{i}")
    return linear(t, name + ".out", x)


def field_density(t, name, features):
    return jnp.exp(jnp.minimum(linear(t, name + ".density", features), 12))


def field_colours(t, name, features, directions, weight, rewritten):
    """Rendered colours [R, 3] for weights [R, S]; directions [R, 27] are encoded."""
    features = features.reshape(*weight.shape, -1)
    if rewritten:
        term = directions @ t[name + ".direction.weight"] + t[name + ".hidden.bias"]
        hidden = relu(features @ t[name + ".hidden.weight"] + term[:, None])
        rendered = jnp.einsum("rs,rsc->rc", weight, hidden)
        return rendered @ t[name + ".colour.weight"] + weight.sum(1, keepdims=True) * t[name + ".colour.bias"]
    repeated = jnp.broadcast_to(directions[:, None], (*weight.shape, directions.shape[1]))
    both = jnp.concatenate([t[name + ".hidden.weight"], t[name + ".direction.weight"]])
    hidden = relu(jnp.concatenate([features, repeated], -1) @ both + t[name + ".hidden.bias"])
    return jnp.einsum("rs,rsc->rc", weight, linear(t, name + ".colour", hidden))


def samples_on(origins, directions, near, far, samples):
    """Points [R S, 3] in the middle of equal parts, depths and intervals [R, S]."""
    depths = near + (far - near) * (jnp.arange(samples, dtype=origins.dtype) + 0.5) / samples
    points = origins[:, None] + depths[..., None] * directions[:, None]
    return points.reshape(-1, 3), depths, jnp.diff(depths, append=far, axis=1)


def whole_range(rays):
    return [jnp.full((len(rays), 1), d, rays.dtype) for d in (NEAR, FAR)]


def scene_loss(t, samples, rewritten):
    planes = jnp.stack([u_net(t, "scene.unet_" + p, t["voxels"][i]) for i, p in enumerate(("xy", "xz", "yz"))])
    points, _, deltas = samples_on(t["origins"], t["directions"], *whole_range(t["origins"]), samples)
    features = sample_planes(planes, points)
    weight = render_weights(field_density(t, "scene", features).reshape(deltas.shape), deltas)
    colours = field_colours(t, "scene", features, encode(t["directions"], 4), weight, rewritten)
    return jnp.mean((colours - t["truth"]) ** 2), {"colours": colours}


def frame_tile(t, origins, directions, near, far, samples, rewritten):
    encoded, features, parts = encode(directions, 4), {}, []
    for name, limits in {"scene": whole_range(origins), "human": (near, far)}.items():
        points, depths, deltas = samples_on(origins, directions, *limits, samples)
        features[name] = sample_planes(t[name + " planes"], points)
        parts.append((depths, field_density(t, name, features[name]).reshape(depths.shape), deltas))
    depths, density, deltas = (jnp.concatenate(x, 1) for x in zip(*parts))
    order = jnp.argsort(depths, 1, stable=True)
    weight = render_weights(*(jnp.take_along_axis(x, order, 1) for x in (density, deltas)))
    weight = jnp.put_along_axis(jnp.zeros_like(weight), order, weight, 1, inplace=False)
    return sum(field_colours(t, name, features[name], encoded, part, rewritten)
               for name, part in zip(features, jnp.split(weight, 2, 1)))
