"""The larger workloads in PyTorch: VGG-19, the style network, radiance fields. Each object is called once per run."""

import torch
import torch.nn.functional as F

from protocol import FAR, NEAR, POOLED_BEFORE, vgg_input, vgg_weights

RATE, BETAS, EPSILON = 1e-4, (0.9, 0.99), 1e-8


def image_of(x):
    """[H, W, C] as torch has it: [1, C, H, W], the memory channels last."""
    return x.permute(2, 0, 1)[None].contiguous(memory_format=torch.channels_last)


def kernel_of(w):
    """[3, 3, in, out] -> [out, in, 3, 3]."""
    return w.permute(3, 2, 0, 1).contiguous(memory_format=torch.channels_last)


def sample_planes(planes, points):
    """planes [3, C, H, W], points [N, 3] -> the product of the three samples, [N, C]."""
    grid = torch.stack([points[:, [0, 1]], points[:, [0, 2]], points[:, [1, 2]]])[:, None]
    found = F.grid_sample(planes, grid, padding_mode="border", align_corners=False)[:, :, 0]
    return (found[0] * found[1] * found[2]).T


def render_weights(density, delta):
    passed = density * delta
    return torch.exp(passed - torch.cumsum(passed, 1)) * -torch.expm1(-passed)


def encode(x, frequencies):
    parts = [x]
    for octave in range(frequencies):
        parts += [torch.sin(2**octave * torch.pi * x), torch.cos(2**octave * torch.pi * x)]
    return torch.cat(parts, -1)


class VggNetwork:
    def __init__(self, path, like):
        self.layers = [
            (name, torch.from_numpy(w).to(like).contiguous(memory_format=torch.channels_last),
             torch.from_numpy(b).to(like))
            for name, w, b in vgg_weights(path)
        ]
        self.matrix, self.shift = (torch.from_numpy(a).to(like) for a in vgg_input())

    def __call__(self, image, last):
        """image [1, 3, H, W] -> the layers' outputs up to relu<last>, by name."""
        x = torch.einsum("nchw,cd->ndhw", image, self.matrix) + self.shift[:, None, None]
        x = x.contiguous(memory_format=torch.channels_last)
        found = {}
        for name, w, b in self.layers:
            if name in POOLED_BEFORE:
                x = F.max_pool2d(x, 2)
            x = F.relu(F.conv2d(x, w, b, padding=1), inplace=not x.requires_grad)
            found[name] = x
            if name == last:
                return found


class Vgg:
    def __init__(self, request, t):
        self.network = VggNetwork(request["vgg"], t["image"])
        self.image = image_of(t["image"])
        self.seed = image_of(t["g"]) if request["part"] != "forward" else None

    def __call__(self):
        if self.seed is None:
            with torch.no_grad():
                return {"features": self.network(self.image, "4_1")["4_1"][0].permute(1, 2, 0)}
        features = self.network(self.image.requires_grad_(), "4_1")["4_1"]
        gradient = torch.autograd.grad(features, self.image, self.seed)[0]
        return {"features": features[0].permute(1, 2, 0), "gradient of image": gradient[0].permute(1, 2, 0)}


class StyleNetwork:
    """The parameters stay in our layout where torch does not mind, so that gradients compare by name."""

    def __init__(self, t):
        self.t = t
        self.parameters = {n: v for n, v in t.items() if n.startswith(("phi", "psi", "decoder"))}
        # Mean and second moment by one product.
        self.moments = torch.cat([t["values"], t["values"] ** 2], 1)

    def layer(self, x, name):
        return torch.addmm(self.t[name + ".bias"], x, self.t[name + ".weight"])

    def attend(self, queries):
        scores = torch.softmax(0.1 * (queries @ self.t["keys"].T), -1)
        mean, square = (scores @ self.moments).chunk(2, -1)
        return mean, torch.sqrt(torch.clamp(square - mean**2, min=1e-12))

    def __call__(self, features, chunk):
        """[H, W, 256] -> [1, 3, H, W]; attention over `chunk` queries at a time."""
        height, width, channels = features.shape
        content = self.layer(F.relu(self.layer(features.reshape(-1, channels), "phi0")), "phi1")
        normal = (content - self.t["mean"]) / self.t["deviation"]
        parts = []
        for queries in normal.split(chunk):
            mean, deviation = self.attend(queries)
            parts.append(deviation * queries + mean)
        x = F.relu(self.layer(F.relu(self.layer(torch.cat(parts), "psi0")), "psi1"))
        x = image_of(x.reshape(height, width, channels))
        for i in range(4):
            x = F.conv2d(x, kernel_of(self.t[f"decoder{i}.weight"]), self.t[f"decoder{i}.bias"], padding=1)
            x = F.relu(x) if i < 3 else x
        return x


class Stylise:
    def __init__(self, request, t):
        self.network, self.features = StyleNetwork(t), t["features"]

    def __call__(self):
        with torch.no_grad():
            return {"image": self.network(self.features, 8192)[0].permute(1, 2, 0)}


def adam(parameters):
    for parameter in parameters.values():
        parameter.requires_grad_()
    return torch.optim.Adam(parameters.values(), RATE, BETAS, EPSILON)


def gradients_of(parameters):
    return {"gradient of " + name: value.grad for name, value in parameters.items()}


class StyleStep:
    def __init__(self, request, t):
        self.network, self.t = StyleNetwork(t), t
        self.vgg = VggNetwork(request["vgg"], t["features"])
        self.optimizer = adam(self.network.parameters)

    def __call__(self):
        image = self.network(self.t["features"], 1 << 30)
        loss = 0
        for name, x in self.vgg(image, "5_1").items():
            if name in POOLED_BEFORE:
                deviation = torch.sqrt(x.var((0, 2, 3)) + 1e-5)
                loss = loss + F.mse_loss(x.mean((0, 2, 3)), self.t[f"relu{name} mean"])
                loss = loss + F.mse_loss(deviation, self.t[f"relu{name} deviation"])
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        return {"image": image[0].permute(1, 2, 0), "loss": loss[None], **gradients_of(self.network.parameters)}


class Heads:
    """What a field makes of the features of its samples."""

    def __init__(self, t, name, rewritten):
        self.t, self.name, self.rewritten = t, name, rewritten

    def weight(self, part):
        return self.t[f"{self.name}.{part}.weight"]

    def bias(self, part):
        return self.t[f"{self.name}.{part}.bias"]

    def density(self, features):
        return torch.exp(torch.clamp(features @ self.weight("density") + self.bias("density"), max=12))

    def hidden(self, features, directions, rays):
        """directions: those of the rays, encoded; rays: the ray of every sample, or the number of samples."""
        if self.rewritten:
            term = directions @ self.weight("direction") + self.bias("hidden")
            if isinstance(rays, int):
                units = (features @ self.weight("hidden")).view(len(directions), rays, -1)
                return F.relu(units + term[:, None]).flatten(0, 1)
            return F.relu(features @ self.weight("hidden") + term[rays])
        x = torch.cat([features, directions.repeat_interleave(rays, 0)], 1)
        return F.relu(torch.addmm(self.bias("hidden"), x, torch.cat([self.weight("hidden"), self.weight("direction")])))

    def colours(self, features, directions, weight):
        """Rendered colours [R, 3] for weights [R, S]."""
        hidden = self.hidden(features, directions, weight.shape[1])
        if self.rewritten:
            rendered = torch.bmm(weight[:, None], hidden.view(*weight.shape, -1))[:, 0]
            return rendered @ self.weight("colour") + weight.sum(1, keepdim=True) * self.bias("colour")
        colours = torch.addmm(self.bias("colour"), hidden, self.weight("colour"))
        return torch.bmm(weight[:, None], colours.view(*weight.shape, 3))[:, 0]

    def sparse_colours(self, features, directions, weight, threshold):
        """The same from the samples alone that weigh more than the threshold."""
        kept = (weight.flatten() > threshold).nonzero()[:, 0]
        rays = kept // weight.shape[1]
        hidden = self.hidden(features[kept], directions, rays) * weight.flatten()[kept, None]
        rendered = hidden.new_zeros(len(weight), hidden.shape[1]).index_add_(0, rays, hidden)
        return rendered @ self.weight("colour") + weight.sum(1, keepdim=True) * self.bias("colour")


def samples_on(origins, directions, near, far, samples):
    """Points [R S, 3] in the middle of equal parts, depths and intervals [R, S]."""
    fraction = (torch.arange(samples, dtype=origins.dtype) + 0.5) / samples
    depths = near + (far - near) * fraction
    points = origins[:, None] + depths[..., None] * directions[:, None]
    return points.flatten(0, 1), depths, torch.diff(depths, append=far, dim=1)


class UNet:
    def __init__(self, t, name):
        self.t, self.name = t, name
        self.kernels = {n: kernel_of(v) for n, v in t.items() if n.startswith(name) and v.dim() == 4}

    def level(self, x, part):
        for half in ("first", "second"):
            name = f"{self.name}.{part}.{half}"
            x = F.relu(F.conv2d(x, self.kernels[name + ".weight"], self.t[name + ".bias"], padding=1))
        return x

    def rise(self, x, part):
        """2x2 transposed convolution with a bias for each pixel of the block: a product, then depth to space."""
        w, b = (self.t[f"{self.name}.{part}.rise.{kind}"] for kind in ("weight", "bias"))
        _, channels, height, width = x.shape
        blocks = torch.addmm(b, x.permute(0, 2, 3, 1).reshape(-1, channels), w)
        blocks = blocks.view(height, width, 2, 2, -1).permute(0, 2, 1, 3, 4)
        return blocks.reshape(1, 2 * height, 2 * width, -1).permute(0, 3, 1, 2)

    def __call__(self, x):
        skips = []
        for i in range(4):
            x = self.level(F.max_pool2d(x, 2) if i else x, f"down{i}")
            skips.append(x)
        for i in (2, 1, 0):
            x = self.level(torch.cat([self.rise(x, f"up{i}"), skips[i]], 1), f"up{i}")
        out = self.t[self.name + ".out.weight"].T[:, :, None, None]
        return F.conv2d(x, out, self.t[self.name + ".out.bias"])


class SceneStep:

    def __init__(self, request, t, rewritten):
        self.t, self.samples, self.encoding = t, request["samples"], request.get("encoding", "full")
        self.parameters = {
            n: v for n, v in t.items() if n.startswith("scene.") and not n.startswith("scene.feature")
        }
        self.optimizer = adam(self.parameters) if request.get("part", "training") == "training" else None
        self.voxels = [image_of(t["voxels"][plane]) for plane in range(3)] if "voxels" in t else None
        self.layers = request.get("layers")
        self.heads = Heads(t, "scene", rewritten)

    def planes(self):
        if self.encoding == "vanilla":
            return self.t["scene.planes"].permute(0, 3, 1, 2)
        names = ("scene.unet_xy", "scene.unet_xz", "scene.unet_yz")
        return torch.cat([UNet(self.t, name)(x) for name, x in zip(names, self.voxels)])

    def features(self, points):
        if self.encoding != "mlp":
            return sample_planes(self.planes(), points)
        x = encode(points, 6)
        for layer in range(self.layers):
            x = torch.addmm(self.t[f"scene.trunk{layer}.bias"], x, self.t[f"scene.trunk{layer}.weight"])
            x = F.relu(x)
        return x

    def __call__(self):
        t = self.t
        near, far = (t["origins"].new_full((len(t["origins"]), 1), d) for d in (NEAR, FAR))
        points, _, deltas = samples_on(t["origins"], t["directions"], near, far, self.samples)
        features = self.features(points)
        density = self.heads.density(features).view(deltas.shape)
        weight = render_weights(density, deltas)
        colours = self.heads.colours(features, encode(t["directions"], 4), weight)
        if not self.optimizer:
            return {"colours": colours}
        loss = F.mse_loss(colours, t["truth"])
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        return {"colours": colours, "loss": loss[None], **gradients_of(self.parameters)}


class Frame:
    TILE = 2048

    def __init__(self, request, t, rewritten):
        self.t, self.samples, self.threshold = t, request["samples"], request["threshold"]
        self.rewritten = rewritten
        self.planes = {
            name: t[name + " planes"].permute(0, 3, 1, 2).contiguous(memory_format=torch.channels_last)
            for name in ("scene", "human")
        }
        self.heads = {name: Heads(t, name, rewritten) for name in self.planes}

    def tile(self, origins, directions, near, far):
        encoded = encode(directions, 4)
        whole = [torch.full_like(near, d) for d in (NEAR, FAR)]
        features, density, depths, deltas = {}, [], [], []
        for name, (a, b) in {"scene": whole, "human": (near, far)}.items():
            points, depth, delta = samples_on(origins, directions, a, b, self.samples)
            features[name] = sample_planes(self.planes[name], points)
            density.append(self.heads[name].density(features[name]).view(depth.shape))
            depths.append(depth)
            deltas.append(delta)
        order = torch.sort(torch.cat(depths, 1), dim=1, stable=True).indices
        weight = render_weights(*(torch.cat(x, 1).gather(1, order) for x in (density, deltas)))
        weight = torch.empty_like(weight).scatter_(1, order, weight).chunk(2, 1)
        colours = 0
        for (name, heads), part in zip(self.heads.items(), weight):
            if self.threshold > 0 and self.rewritten:
                colours = colours + heads.sparse_colours(features[name], encoded, part, self.threshold)
            else:
                colours = colours + heads.colours(features[name], encoded, part)
        return colours

    def __call__(self):
        rays = [self.t[name].split(self.TILE) for name in ("origins", "directions", "near", "far")]
        with torch.no_grad():
            return {"colours": torch.cat([self.tile(*tile) for tile in zip(*rays)])}
