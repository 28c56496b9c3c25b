#!/usr/bin/env bash
# Fuzzes one target: ./run.sh TARGET [libFuzzer's options]. Needs cargo-fuzz and a nightly toolchain, no Vulkan.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
target=$1
shift
if ls /usr/lib/*-linux-gnu/libshaderc_combined.a >/dev/null 2>&1; then
    mkdir -p .cargo
    ln -sf ../../scripts/shaderc-debian.toml .cargo/config.toml
fi
mkdir -p "corpus/$target"
exec cargo +nightly fuzz run --fuzz-dir . -s "${SANITIZER:-none}" "$target" -- \
    -dict=gltf.dict -timeout=10 -rss_limit_mb=2048 -max_len=100000 "$@"
