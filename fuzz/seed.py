#!/usr/bin/env python3
"""Fills the fuzzer's first corpora from a folder of glTF files: seed.py FOLDER [FOLDER...]

Every document of at most 100 KB becomes one .glb with its buffers and pictures inside, and stays as it is if it needs
nothing beside it. Pictures and compressed data go to the targets for those alone.
"""

import base64
import hashlib
import json
import struct
import sys
import urllib.parse
from pathlib import Path

MOST = 100_000
TO = Path(__file__).parent / "corpus"


def put(target, data):
    """Writes a seed, named by its content."""
    if 0 < len(data) <= MOST:
        folder = TO / target
        folder.mkdir(parents=True, exist_ok=True)
        (folder / hashlib.sha1(data).hexdigest()).write_bytes(data)


def bytes_of(uri, folder):
    """What a URI holds or names; None if it cannot be had."""
    try:
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        return (folder / urllib.parse.unquote(uri)).read_bytes()
    except (OSError, ValueError, IndexError):
        return None


def split(data):
    """JSON and BIN chunk of a .glb; a .gltf has no BIN chunk."""
    if data[:4] != b"glTF":
        return json.loads(data), b""
    length = struct.unpack_from("<I", data, 12)[0]
    rest = data[20 + length :]
    return json.loads(data[20 : 20 + length]), rest[8:]


def packed(document, binary):
    """A .glb."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunk = struct.pack("<I4s", len(binary), b"BIN\0") + binary if binary else b""
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(chunk))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + chunk


def embed(document, binary, folder):
    """Moves all buffers and pictures into one BIN chunk; None if something is missing."""
    starts, data = [], b""
    for index, buffer in enumerate(document.get("buffers", [])):
        own = bytes_of(buffer["uri"], folder) if "uri" in buffer else (binary if index == 0 else b"")
        if own is None:
            return None
        data += b"\0" * (-len(data) % 16)
        starts.append(len(data))
        data += own
    for view in document.get("bufferViews", []):
        extensions = view.get("extensions", {})
        for own in [view, extensions.get("EXT_meshopt_compression"), extensions.get("KHR_meshopt_compression")]:
            if own is not None:
                own["byteOffset"] = own.get("byteOffset", 0) + starts[own["buffer"]]
                own["buffer"] = 0
    for image in document.get("images", []):
        own = bytes_of(image.pop("uri"), folder) if "uri" in image else None
        if own is not None:
            put("images", own)
            views = document.setdefault("bufferViews", [])
            image["bufferView"] = len(views)
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(own)})
            data += own
    if data:
        document["buffers"] = [{"byteLength": len(data)}]
    return packed(document, data)


def parts(document, data):
    """Seeds for the targets of pictures and of compressed data."""
    views = document.get("bufferViews", [])

    def of(view):
        start = view.get("byteOffset", 0)
        return data[start : start + view["byteLength"]]

    for image in document.get("images", []):
        if "bufferView" in image:
            put("images", of(views[image["bufferView"]]))
    modes = {"ATTRIBUTES": 1, "TRIANGLES": 2, "INDICES": 3}
    filters = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"]
    for view in views:
        extension = view.get("extensions", {}).get("EXT_meshopt_compression")
        if extension:
            mode, filter_ = modes[extension["mode"]], filters.index(extension.get("filter", "NONE"))
            put("compressed", bytes([mode, filter_, min(extension["count"] // 3, 255)]) + of(extension))
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            draco = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
            if draco:
                put("compressed", of(views[draco["bufferView"]]))


def main():
    for root in map(Path, sys.argv[1:]):
        for path in sorted(root.rglob("*.gl*")):
            data = path.read_bytes()
            if path.suffix not in (".gltf", ".glb"):
                continue
            put("read", data)
            try:
                document, binary = split(data)
                whole = embed(document, binary, path.parent)
                if whole is not None:
                    put("read", whole)
                    document, binary = split(whole)
                    parts(document, binary)
            except (ValueError, KeyError, TypeError, AttributeError, IndexError, struct.error):
                continue  # A broken document: its own bytes are seed enough.


main()
