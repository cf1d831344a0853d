"""Collects the pictures that `vivant pretrain-stylizer` is trained on, from Debian packages.

    stylizer_pictures.py OUT      fills OUT/photographs and OUT/paintings (about 130 pictures)

Needs Debian's apt-get and dpkg, and Pillow. The pictures are only trained on, never passed on.
  opencv-doc                 photographs among OpenCV's samples (Apache 2.0)
  gcompris-qt-data           photographs of monuments (CC BY-SA, public domain) and 21 paintings, from Bellini to Kandinsky
                             (public domain)
  lomiri-wallpapers-16.04    photographs (CC BY-SA)
  mate-backgrounds           photographs (CC BY-SA, GPL)
"""

import io
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

from PIL import Image

OPENCV = """fruits.jpg baboon.jpg squirrel_cls.jpg leuvenA.jpg aloeL.jpg board.jpg stuff.jpg aero1.jpg aero3.jpg home.jpg
    building.jpg graf1.png smarties.png rubberwhale1.png butterfly.jpg orange.jpg apple.jpg right.jpg chicky_512.png
    left05.jpg Blender_Suzanne1.jpg ela_original.jpg basketball1.png box_in_scene.png plant.jpg scenetext01.jpg
    scenetext02.jpg scenetext03.jpg scenetext04.jpg scenetext05.jpg scenetext06.jpg licenseplate_motion.jpg 000.jpg
    001.jpg 002.jpg""".split()
PACKAGES = ["opencv-doc", "gcompris-qt-data", "lomiri-wallpapers-16.04", "mate-backgrounds"]
LEAST_SIDE = 128  # of what is kept
LARGEST_SIDE = 800
BOARD_SIZE = (702, 515)  # on which GCompris lays its jigsaw pieces
FRAME = 3  # pixels of a border that pieces leave ragged
UNSEEN = "The Great Wave"  # kept for trying the stylizer on a painting that it never saw


def unpack(package: str, folder: Path) -> Path:
    subprocess.run(["apt-get", "download", package], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    (archive,) = folder.glob(f"{package}_*.deb")
    subprocess.run(["dpkg", "-x", archive, folder / package], check=True)
    return folder / package


def keep(image: Image.Image, path: Path) -> None:
    image = image.convert("RGB")
    if min(image.size) < LEAST_SIDE:
        return
    image.thumbnail((LARGEST_SIDE, LARGEST_SIDE), Image.Resampling.LANCZOS)
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path.with_suffix(".png"))


def resources(path: Path) -> dict[str, bytes]:
    """The files in a Qt resource file (.rcc), by their path."""
    data = path.read_bytes()
    version, tree, content, names = struct.unpack(">IIII", data[4:20])
    node_size = 22 if version >= 2 else 14
    found = {}

    def walk(index: int, prefix: str) -> None:
        node = tree + index * node_size
        name, flags = struct.unpack(">IH", data[node : node + 6])
        (length,) = struct.unpack(">H", data[names + name : names + name + 2])
        start = names + name + 6
        label = data[start : start + 2 * length].decode("utf-16-be") if index else ""
        if flags & 2:  # a folder
            count, first = struct.unpack(">II", data[node + 6 : node + 14])
            for child in range(first, first + count):
                walk(child, f"{prefix}/{label}")
            return
        offset = content + struct.unpack(">I", data[node + 10 : node + 14])[0]
        (size,) = struct.unpack(">I", data[offset : offset + 4])
        blob = data[offset + 4 : offset + 4 + size]
        found[f"{prefix}/{label}"] = zlib.decompress(blob[4:]) if flags & 1 else blob

    walk(0, "")
    return found


def painting(board: str, files: dict[str, bytes]) -> Image.Image:
    """A painting put together from its jigsaw pieces; a board gives the centre of each, as a part of its size."""
    canvas = Image.new("RGBA", BOARD_SIZE)
    for name, x, y in re.findall(r'"pixmapfile" : "image/(\S+webp)",\s*"x" ?: ?"([\d.]+)",\s*"y" ?: ?"([\d.]+)"', board):
        (data,) = (data for path, data in files.items() if path.endswith("/" + name))
        piece = Image.open(io.BytesIO(data)).convert("RGBA")
        left, top = (round(float(at) * size - extent / 2)
                     for at, size, extent in zip((x, y), BOARD_SIZE, piece.size, strict=True))
        canvas.alpha_composite(piece, (max(left, 0), max(top, 0)))
    left, top, right, bottom = canvas.getbbox()
    return canvas.crop((left + FRAME, top + FRAME, right - FRAME, bottom - FRAME))


def main() -> None:
    out = Path(sys.argv[1])
    photographs, paintings = out / "photographs", out / "paintings"
    with tempfile.TemporaryDirectory() as name:
        roots = {package: unpack(package, Path(name)) for package in PACKAGES}
        for path in sorted(roots["opencv-doc"].rglob("*")):
            if path.name in OPENCV:
                keep(Image.open(path), photographs / f"opencv-{path.name}")
        rcc = roots["gcompris-qt-data"] / "usr/share/gcompris-qt/rcc"
        for path, data in resources(rcc / "explore_monuments.rcc").items():
            if path.endswith((".webp", ".jpg")):
                keep(Image.open(io.BytesIO(data)), photographs / f"monument-{Path(path).stem}")
        files = resources(rcc / "paintings.rcc")
        for path, data in files.items():
            if re.search(r"/board\d+_0\.qml$", path) and UNSEEN not in data.decode():
                keep(painting(data.decode(), files), paintings / f"gcompris-{Path(path).stem}")
        walls = [roots["lomiri-wallpapers-16.04"] / "usr/share/backgrounds",
                 roots["mate-backgrounds"] / "usr/share/backgrounds/mate/nature"]
        for path in sorted(path for folder in walls for path in folder.rglob("*.jpg")):
            keep(Image.open(path), photographs / f"wallpaper-{path.stem}")
    for folder in (photographs, paintings):
        print(f"{folder}: {len(list(folder.iterdir()))} pictures")


if __name__ == "__main__":
    main()
