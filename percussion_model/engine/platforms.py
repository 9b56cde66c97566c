"""Systems and processors that libraries are made for."""

from __future__ import annotations

import platform
from typing import NamedTuple


class Platform(NamedTuple):
    """A system and processor.

    Attributes
    ----------
    triple : str
        For LLVM.
    zig : str
        For zig, which compiles for all of them.
    suffix : str
        Of the library.
    """

    triple: str
    zig: str
    suffix: str


# By their names in FMI 3.0.
PLATFORMS = {
    "x86_64-linux": Platform("x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", ".so"),
    "x86_64-windows": Platform("x86_64-pc-windows-gnu", "x86_64-windows-gnu", ".dll"),
    "x86_64-darwin": Platform("x86_64-apple-macosx11.0", "x86_64-macos.11.0", ".dylib"),
    "aarch64-linux": Platform("aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", ".so"),
    "aarch64-darwin": Platform("arm64-apple-macosx11.0", "aarch64-macos.11.0", ".dylib"),
}

# What a browser runs, by its name here. Python runs on none such: no wheel or FMU is for it.
WASM = "wasm32"
TARGETS = PLATFORMS | {WASM: Platform("wasm32-unknown-unknown", "wasm32-wasi-musl", ".wasm")}


def this_platform() -> str:
    """Name of the platform that this is."""
    processor = platform.machine().lower()
    processor = {"amd64": "x86_64", "arm64": "aarch64"}.get(processor, processor)
    return f"{processor}-{platform.system().lower()}"
