"""The workloads in JAX, compiled by XLA. `peer_jax.py rewritten`: see peer_torch.py."""

import sys

import jax
import jax.numpy as jnp
import numpy as np

from jax_models import (conv, frame_tile, render_weights, sample_planes, scene_loss, style_loss, stylise, vgg_network)
from protocol import read_tensors, serve, vgg_input, vgg_weights

REWRITTEN = "rewritten" in sys.argv
RATE, BETAS, EPSILON = 1e-4, (0.9, 0.99), 1e-8
TILE = 4050  # rays of a frame at a time


def load_convolution(request, t):
    if request["part"] == "forward":
        return jax.jit(lambda x, w, g: {"y": conv(x, w)}), (t["x"], t["w"], t["g"])
    to_data = request["part"] == "data gradient"

    def gradient(x, w, g):
        pull = jax.vjp(lambda v: conv(v, w) if to_data else conv(x, v), x if to_data else w)[1]
        return {"y": pull(g)[0]}

    return jax.jit(gradient), (t["x"], t["w"], t["g"])


def load_product(request, t):
    if request["part"] == "forward":
        return jax.jit(lambda x, w: {"y": x @ w}), (t["x"], t["w"])
    both = jax.jit(lambda x, w, g: {"gradient of x": g @ w.T, "gradient of w": x.T @ g})
    return both, (t["x"], t["w"], t["g"])


def load_perceptron(request, t):
    layers = len(request["widths"]) - 1
    values = {name: value for name, value in t.items() if name != "g"}

    def forward(values):
        y = values["x"]
        for i in range(layers):
            y = y @ values[f"w{i}"] + values[f"b{i}"]
            y = jax.nn.relu(y) if i + 1 < layers else y
        return y

    def both(values, g):
        y, pull = jax.vjp(forward, values)
        return {"y": y, **{"gradient of " + name: value for name, value in pull(g)[0].items()}}

    if request["part"] == "forward":
        return jax.jit(lambda values: {"y": forward(values)}), (values,)
    return jax.jit(both), (values, t["g"])


def load_triplane(request, t):
    if request["part"] == "gather":
        return jax.jit(lambda planes, points: {"y": sample_planes(planes, points)}), (t["planes"], t["points"])
    pull = jax.jit(lambda planes, points: jax.vjp(lambda p: sample_planes(p, points), planes)[1])(
        t["planes"], t["points"])
    return jax.jit(lambda pull, g: {"y": pull(g)[0]}), (pull, t["g"])


def load_volume_rendering(request, t):
    def render(density, feature):
        weight = render_weights(density, t["delta"])
        return weight, jnp.einsum("rs,rsc->rc", weight, feature.reshape(*weight.shape, -1))

    def forward(density, feature):
        weight, rendered = render(density, feature)
        depth = (weight * t["depths"]).sum(1, keepdims=True)
        return {"feature": rendered, "alpha": weight.sum(1, keepdims=True), "depth": depth}

    if request["part"] == "forward":
        return jax.jit(forward), (t["density"], t["feature"])
    pull = jax.jit(lambda d, f: jax.vjp(lambda *x: render(*x)[1], d, f)[1])(t["density"], t["feature"])

    def backward(pull, g):
        gradients = pull(g)
        return {"gradient of density": gradients[0], "gradient of feature": gradients[1]}

    return jax.jit(backward), (pull, t["g"])


def vgg_of(request):
    layers = {name: (jnp.asarray(w.transpose(2, 3, 1, 0), jnp.float32), jnp.asarray(b, jnp.float32))
              for name, w, b in vgg_weights(request["vgg"])}
    return layers, [jnp.asarray(a, jnp.float32) for a in vgg_input()]


def load_vgg(request, t):
    layers, colours = vgg_of(request)
    forward = lambda image, layers: vgg_network(image, layers, colours, "4_1")["4_1"]

    def both(image, layers, g):
        features, pull = jax.vjp(lambda x: forward(x, layers), image)
        return {"features": features, "gradient of image": pull(g)[0]}

    if request["part"] == "forward":
        return jax.jit(lambda image, layers: {"features": forward(image, layers)}), (t["image"], layers)
    return jax.jit(both), (t["image"], layers, t["g"])


def load_stylise(request, t):
    return jax.jit(lambda t: {"image": stylise(t, t["features"], 8100)}), (t,)


def training(loss_of, t, is_trained):
    """A step of Adam; `loss_of(t)` gives (loss, outputs by name)."""
    state = {"p": {n: v for n, v in t.items() if is_trained(n)}, "t": jnp.zeros((), jnp.int32)}
    state["m"], state["v"] = (jax.tree.map(jnp.zeros_like, state["p"]) for _ in range(2))
    rest = {n: v for n, v in t.items() if not is_trained(n)}

    def step(state, rest):
        (loss, outputs), g = jax.value_and_grad(lambda p: loss_of({**rest, **p}), has_aux=True)(state["p"])
        count = state["t"] + 1
        m = jax.tree.map(lambda m, g: BETAS[0] * m + (1 - BETAS[0]) * g, state["m"], g)
        v = jax.tree.map(lambda v, g: BETAS[1] * v + (1 - BETAS[1]) * g * g, state["v"], g)
        first, second = 1 - BETAS[0] ** count, 1 - BETAS[1] ** count
        p = jax.tree.map(lambda p, m, v: p - RATE * (m / first) / (jnp.sqrt(v / second) + EPSILON), state["p"], m, v)
        found = {**outputs, "loss": loss[None], **{"gradient of " + n: x for n, x in g.items()}}
        return {"p": p, "m": m, "v": v, "t": count}, found

    compiled = jax.jit(step, donate_argnums=0)

    def run(_):
        nonlocal state
        state, found = compiled(state, rest)
        return found

    return run, (None,)


def load_style_step(request, t):
    layers, colours = vgg_of(request)
    return training(lambda t: style_loss(t, layers, colours), t, lambda n: n.startswith(("phi", "psi", "decoder")))


def load_scene_step(request, t):
    trained = lambda n: n.startswith("scene.") and not n.startswith("scene.feature")
    return training(lambda t: scene_loss(t, request["samples"], REWRITTEN), t, trained)


def load_frame(request, t):
    rays = [t.pop(name) for name in ("origins", "directions", "near", "far")]
    tile = jax.jit(lambda t, *rays: frame_tile(t, *rays, request["samples"], REWRITTEN))
    starts = range(0, len(rays[0]), TILE)
    return lambda t: {"colours": jnp.concatenate([tile(t, *(x[i : i + TILE] for x in rays)) for i in starts])}, (t,)


LOADERS = {
    "convolution": load_convolution,
    "product": load_product,
    "perceptron": load_perceptron,
    "triplane": load_triplane,
    "volume rendering": load_volume_rendering,
    "vgg": load_vgg,
    "stylise": load_stylise,
    "style step": load_style_step,
    "scene step": load_scene_step,
    "frame": load_frame,
}


def load(request):
    if request["mode"] != "fp32":
        raise ValueError("JAX takes part in fp32 alone")
    tensors = {name: jnp.asarray(value, jnp.float32) for name, value in read_tensors(request["inputs"]).items()}
    work, arguments = LOADERS[request["workload"]](request, tensors)
    found = {}

    def run():
        found.update(jax.block_until_ready(work(*arguments)))

    return run, lambda: {name: np.asarray(value, np.float64) for name, value in found.items()}


if __name__ == "__main__":
    serve(load)
