"""Makes the asset files and compares each with its recorded checksum (see scripts/make-assets)."""

import argparse
import hashlib
import sys
from pathlib import Path

import body
import stlpips
import styles
import vgg19

MAKERS = {"vgg19": vgg19.make, "stlpips": stlpips.make, "body": body.make, "styles": styles.make}
CHECKSUMS = "checksums.sha256"


def read_checksums(path: Path) -> dict[str, str]:
    if not path.exists():
        return {}
    pairs = (line.split("  ", 1) for line in path.read_text().splitlines())
    return {name: checksum for checksum, name in pairs}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("assets", nargs="*", metavar="ASSET", help="default: all")
    parser.add_argument("--downloads", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--accept", action="store_true", help="record the new checksums")
    arguments = parser.parse_args()

    recorded = read_checksums(arguments.output / CHECKSUMS)
    changed = []
    for asset in arguments.assets or MAKERS:
        for path in MAKERS[asset](arguments.downloads, arguments.output):
            name = str(path.relative_to(arguments.output))
            checksum = hashlib.sha256(path.read_bytes()).hexdigest()
            changed += [name] if recorded.get(name) != checksum else []
            print(f"{checksum[:16]}  {path.stat().st_size:>10} bytes  {name}"
                  + ("  CHANGED" if name in changed else ""))
            recorded[name] = checksum
    if arguments.accept:
        lines = (f"{checksum}  {name}\n" for name, checksum in sorted(recorded.items()))
        (arguments.output / CHECKSUMS).write_text("".join(lines))
    elif changed:
        print(f"make-assets: {', '.join(changed)}: not what {CHECKSUMS} records; look at the difference, then run "
              "again with --accept (git checkout assets/ restores the recorded files)", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
