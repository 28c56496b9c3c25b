# Sourced by render.sh and test.sh: installs what is missing on Debian and Ubuntu (`more_packages` too), and sets
# `cargo_config`.
# Says nothing when nothing is to be done; what it says goes to standard error.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# install PACKAGE… : those of them that are missing
install() {
    local missing=()
    local package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return
    echo "installing ${missing[*]}" >&2
    local sudo=
    if [ "$(id -u)" -ne 0 ]; then
        sudo=$(command -v sudo) || { echo "neither root nor sudo: install ${missing[*]} yourself" >&2; exit 2; }
    fi
    export DEBIAN_FRONTEND=noninteractive
    { $sudo apt-get update -q && $sudo apt-get install -y -q --no-install-recommends "${missing[@]}"; } >&2 || {
        echo "could not install ${missing[*]}" >&2
        exit 2
    }
}

# A GPU brings its own driver; Mesa's software Vulkan stands in where there is none.
packages=(libvulkan1 mesa-vulkan-drivers g++ libshaderc-dev)
if command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; then
    install "${packages[@]}" ${more_packages[@]+"${more_packages[@]}"}
else
    echo "this is neither Debian nor Ubuntu: a Vulkan loader and driver and a C++ compiler must be there already" >&2
fi
command -v cargo >/dev/null || { echo "no Rust toolchain: install one from rustup.rs" >&2; exit 2; }

# Debian's shaderc libraries instead of a build from source, where they are.
cargo_config=()
if ls /usr/lib/*-linux-gnu/libshaderc_combined.a >/dev/null 2>&1; then
    cargo_config=(--config "$root/scripts/shaderc-debian.toml")
fi
