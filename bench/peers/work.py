"""The workloads of scripts/compare-peers with their sizes, and who takes part in them."""

from peers import FRAMEWORKS, ONEDNN, OPENBLAS, REWRITTEN, WINOGRAD


class Work:
    """`ours`: other work of our own program that takes part as a peer, as {name: sizes that differ}. `checked_at`:
    smaller sizes at which errors are measured, where the reference in fp64 would not fit into memory."""

    def __init__(self, group, name, workload, peers, quick=True, ours=None, checked_at=None, **sizes):
        self.group, self.name, self.peers, self.quick = group, name, peers, quick
        self.ours, self.checked_at = ours or {}, checked_at or {}
        self.request = {"workload": workload, **sizes}


def convolutions():
    for channels_in, channels_out, height, width in [(64, 64, 128, 128), (32, 32, 256, 256), (256, 128, 270, 480)]:
        for part in ("forward", "data gradient", "weight gradient"):
            name = f"conv {channels_in}->{channels_out} at {height}x{width}, {part}"
            peers = [ONEDNN, WINOGRAD, *FRAMEWORKS]
            yield Work("conv", name, "convolution", peers, quick=height < 270, part=part, height=height, width=width,
                       **{"in": channels_in, "out": channels_out})


def fields():
    """The tri-plane field against perceptrons on the same samples: NeRF's, and a small one."""
    perceptrons = {
        f"our {layers}x{width} MLP field": {"encoding": "mlp", "layers": layers, "width": width}
        for layers, width in [(8, 256), (4, 64)]
    }
    for planes, rays, quick in [(128, 1024, True), (256, 4096, False)]:
        for what, encoding, part in [
            ("rendering, planes baked", "vanilla", "forward"),
            ("training step, U-Nets in it", "full", "training"),
            ("training step, planes themselves trained", "vanilla", "training"),
        ]:
            yield Work("fields", f"field on {planes}x{planes} planes, {rays} rays x 128, {what}", "scene step", [],
                       quick=quick, ours=perceptrons, checked_at={} if quick else {"rays": 1024}, planes=planes,
                       rays=rays, samples=128, encoding=encoding, part=part)


def volume_rendering():
    """Beside the frameworks, a triad (y = a + s b) that moves the bytes that must move: what is read and what is
    written, once each."""
    rays, samples, channels = 16384, 128, 32
    feature, number, ray = rays * samples * channels * 4, rays * samples * 4, rays * channels * 4
    must_move = {
        "forward": feature + 3 * number + ray,  # density, intervals and depths in, the rendered features out
        "backward": 2 * feature + 3 * number + ray,  # density and intervals in, the density's gradient out
    }
    for part, size in must_move.items():
        triad = {"our triad of the bytes that must move": {"workload": "triad", "bytes": size}}
        yield Work("rendering", f"volume rendering {rays} x {samples} x {channels}, {part}", "volume rendering",
                   FRAMEWORKS, ours=triad, part=part, rays=rays, samples=samples, channels=channels)


def workloads():
    yield from convolutions()
    for part in ("forward", "backward"):
        yield Work("gemm", f"GEMM 1024^3, {part}", "product", [ONEDNN, OPENBLAS, *FRAMEWORKS], part=part, rows=1024,
                   **{"in": 1024, "out": 1024})
    for part in ("forward", "forward and backward"):
        yield Work("mlp", f"MLP 48-128-128-32, 196608 rows, {part}", "perceptron", [ONEDNN, *FRAMEWORKS], part=part,
                   rows=196608, widths=[48, 128, 128, 32])
    for part in ("gather", "scatter"):
        exchange = {"our compare-exchange kernel": {"part": "scatter by compare-exchange"}} if part == "scatter" else {}
        yield Work("triplane", f"tri-plane {part}, 524288 points x 32", "triplane", FRAMEWORKS, ours=exchange,
                   part=part, size=256, channels=32, rays=4096, samples=128)
    yield from fields()
    yield from volume_rendering()
    for part in ("forward", "forward and gradient"):
        yield Work("W4", f"W4 VGG-19 to relu4_1 at 256x256, {part}", "vgg", FRAMEWORKS, part=part, side=256)
    yield Work("W1s", "W1s scene step, 128x128 planes, 1024 rays", "scene step", FRAMEWORKS + REWRITTEN, planes=128,
               rays=1024, samples=128)
    yield Work("W1", "W1 scene step, 256x256 planes, 4096 rays", "scene step", FRAMEWORKS + REWRITTEN, quick=False,
               planes=256, rays=4096, samples=128)
    for side in (64, 192):
        yield Work("W5", f"W5 style step, {side}x{side}", "style step", FRAMEWORKS, quick=side == 64, side=side,
                   tokens=4096)
    yield Work("W3", "W3 stylise a 480x270 map", "stylise", FRAMEWORKS, quick=False, height=270, width=480,
               tokens=4096)
    # The plain peers evaluate every sample, whatever it weighs.
    for name, threshold, peers in [("every sample", 0, FRAMEWORKS + REWRITTEN), ("with skipping", 1e-4, REWRITTEN)]:
        yield Work("W2", f"W2 frame 480x270, {name}", "frame", peers, quick=False, planes=256, height=270, width=480,
                   samples=128, threshold=threshold)
