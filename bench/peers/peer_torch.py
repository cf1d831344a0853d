"""The workloads in PyTorch. `peer_torch.py rewritten` uses the same algebra as ours: hidden units are rendered
before the last layer, and the view's term of the hidden layer is computed once for each ray."""

import sys

import torch
import torch.nn.functional as F

from protocol import read_tensors, serve
from torch_models import Frame, SceneStep, Stylise, StyleStep, Vgg, image_of, sample_planes

torch.set_num_threads(2)
REWRITTEN = "rewritten" in sys.argv


def load_convolution(request, t):
    x, g = image_of(t["x"]), image_of(t["g"])
    w = t["w"].permute(3, 2, 0, 1).contiguous(memory_format=torch.channels_last)
    if request["part"] == "forward":
        return lambda: {"y": F.conv2d(x, w, padding=1)[0].permute(1, 2, 0)}
    to_data = request["part"] == "data gradient"
    if request["mode"] == "bf16":  # autocast knows forward operations alone
        x, w, g = (value.bfloat16() for value in (x, w, g))

    def run():
        gradients = torch.ops.aten.convolution_backward(
            g, x, w, None, [1, 1], [1, 1], [1, 1], False, [0, 0], 1, [to_data, not to_data, False])
        return {"y": gradients[0][0].permute(1, 2, 0) if to_data else gradients[1].permute(2, 3, 1, 0)}

    return run


def load_product(request, t):
    x, w, g = t["x"], t["w"], t["g"]
    if request["part"] == "forward":
        return lambda: {"y": x @ w}
    return lambda: {"gradient of x": g @ w.T, "gradient of w": x.T @ g}


def load_perceptron(request, t):
    layers = len(request["widths"]) - 1
    parameters = [(t[f"w{i}"].T.contiguous(), t[f"b{i}"]) for i in range(layers)]

    def forward():
        y = t["x"]
        for i, (w, b) in enumerate(parameters):
            y = F.linear(y, w, b)
            y = F.relu(y) if i + 1 < layers else y
        return y

    if request["part"] == "forward":
        return lambda: {"y": torch.no_grad()(forward)()}
    wrt = [t["x"]] + [p for pair in parameters for p in pair]
    for value in wrt:
        value.requires_grad_()
    names = ["x"] + [f"{kind}{i}" for i in range(layers) for kind in "wb"]

    def run():
        y = forward()
        gradients = torch.autograd.grad(y, wrt, t["g"])
        found = {"gradient of " + n: g.T if n[0] == "w" else g for n, g in zip(names, gradients)}
        return {"y": y, **found}

    return run


def load_triplane(request, t):
    planes = t["planes"].permute(0, 3, 1, 2).contiguous(memory_format=torch.channels_last)
    if request["part"] == "gather":
        return lambda: {"y": sample_planes(planes, t["points"])}
    y = sample_planes(planes.requires_grad_(), t["points"])
    return lambda: {"y": torch.autograd.grad(y, planes, t["g"], retain_graph=True)[0].permute(0, 2, 3, 1)}


def load_volume_rendering(request, t):
    rays, samples, channels = request["rays"], request["samples"], request["channels"]
    density, feature = t["density"], t["feature"].view(rays, samples, channels)

    def render():
        passed = density * t["delta"]
        behind = torch.cumsum(passed, 1)
        weight = torch.exp(passed - behind) * -torch.expm1(-passed)
        return weight, torch.bmm(weight[:, None], feature)[:, 0]

    if request["part"] == "forward":

        def run():
            with torch.no_grad():
                weight, rendered = render()
                depth = (weight * t["depths"]).sum(1, keepdim=True)
                return {"feature": rendered, "alpha": weight.sum(1, keepdim=True), "depth": depth}

        return run
    density.requires_grad_()
    feature.requires_grad_()
    rendered = render()[1]

    def backward():
        gradients = torch.autograd.grad(rendered, [density, feature], t["g"], retain_graph=True)
        return {"gradient of density": gradients[0], "gradient of feature": gradients[1].flatten(0, 1)}

    return backward


def load_triad(request, t):
    return lambda: {"y": torch.add(t["a"], t["b"], alpha=0.5)}


LOADERS = {
    "convolution": load_convolution,
    "product": load_product,
    "perceptron": load_perceptron,
    "triplane": load_triplane,
    "volume rendering": load_volume_rendering,
    "triad": load_triad,
    "vgg": Vgg,
    "stylise": Stylise,
    "style step": StyleStep,
    "scene step": lambda request, t: SceneStep(request, t, REWRITTEN),
    "frame": lambda request, t: Frame(request, t, REWRITTEN),
}
SINGLE = {"fp32": torch.float32, "bf16": torch.float32, "fp64": torch.float64}


def load(request):
    mode = request["mode"]
    tensors = {n: torch.from_numpy(v).to(SINGLE[mode]) for n, v in read_tensors(request["inputs"]).items()}
    work = LOADERS[request["workload"]](request, tensors)
    found = {}

    def run():
        with torch.autocast("cpu", torch.bfloat16, enabled=mode == "bf16"):
            found.update(work())

    return run, lambda: {name: value.detach().double().numpy() for name, value in found.items()}


if __name__ == "__main__":
    serve(load)
