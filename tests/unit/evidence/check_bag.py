#!/usr/bin/env python3
"""Is a folder a complete and valid BagIt 1.0 bag? Written from RFC 8493 alone, for the tests: it shares no code
with what it checks. Prints what is wrong, one finding a line; exit code 0 if nothing is."""
import hashlib, os, re, sys

def main(bag):
    wrong = []
    def file(name):
        with open(os.path.join(bag, name), "rb") as stream:
            return stream.read()
    # 2.1.1: the declaration, byte for byte, without a byte-order mark.
    if file("bagit.txt") != b"BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n":
        wrong.append("bagit.txt is not the declaration")
    if not os.path.isdir(os.path.join(bag, "data")):
        wrong.append("no payload folder data/")
    found = set()
    for folder, _, names in os.walk(bag):
        found |= {os.path.relpath(os.path.join(folder, name), bag) for name in names}

    def manifest(name):
        lines = {}
        for line in file(name).decode("utf-8").splitlines():
            match = re.fullmatch(r"([0-9A-Fa-f]{64})[ \t]+\*?(.+)", line)
            if not match:
                wrong.append(f"{name}: no manifest line: {line}")
                continue
            # 2.1.3: CR, LF and % are percent-encoded in paths.
            path = re.sub(r"%(0[Aa]|0[Dd]|25)", lambda m: chr(int(m[1], 16)), match[2])
            if path in lines:
                wrong.append(f"{name}: {path} is listed twice")
            if path.startswith(("/", "~")) or ".." in path.split("/"):
                wrong.append(f"{name}: {path} leaves the bag")
            lines[path] = match[1].lower()
        for path, recorded in lines.items():
            if path not in found:
                wrong.append(f"{name}: {path} is missing")
            elif hashlib.sha256(file(path)).hexdigest() != recorded:
                wrong.append(f"{name}: {path} has another sum")
        return lines

    payload = manifest("manifest-sha256.txt")
    tags = manifest("tagmanifest-sha256.txt")
    inside = {path for path in found if path.startswith("data/")}
    if inside != set(payload):
        wrong.append(f"payload not in the manifest, or the reverse: {sorted(inside ^ set(payload))}")
    if any(path.startswith("data/") or path.startswith("tagmanifest") for path in tags):
        wrong.append("the tag manifest lists payload or a tag manifest")
    if "manifest-sha256.txt" not in tags:
        wrong.append("the tag manifest does not list the manifest")
    # 2.2.2: "Label: value" lines; Payload-Oxum is octets.streams.
    info = {}
    for line in file("bag-info.txt").decode("utf-8").splitlines():
        label, colon, value = line.partition(": ")
        if not colon:
            wrong.append(f"bag-info.txt: no label: {line}")
        info[label] = value
    octets = sum(os.path.getsize(os.path.join(bag, path)) for path in inside)
    if info.get("Payload-Oxum") != f"{octets}.{len(inside)}":
        wrong.append(f"Payload-Oxum is {info.get('Payload-Oxum')}, found {octets}.{len(inside)}")
    print("\n".join(wrong))
    return 1 if wrong else 0

sys.exit(main(sys.argv[1]))
