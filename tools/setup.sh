# Sourced by the other tools: makes sure of a linker and of a Vulkan adapter, on Debian and its kin by apt. Says what it does
# before it does it. Every function leaves the system alone where nothing is missing.

say() { printf 'abbe: %s\n' "$*" >&2; }

# True if the Vulkan loader and at least one driver are installed. Looks at files only: asking a driver would take one.
have_vulkan() {
    local file libraries
    [ "$(uname -s)" = Linux ] || return 0 # Metal and Direct3D come with the system
    # Captured, not piped: a reader that has seen enough would make ldconfig fail.
    libraries=$(PATH=$PATH:/usr/sbin:/sbin ldconfig -p 2>/dev/null) || true
    case "$libraries" in
    *libvulkan.so.1*) ;;
    *) return 1 ;;
    esac
    if [ -n "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" ]; then
        local IFS=:
        for file in ${VK_DRIVER_FILES:-$VK_ICD_FILENAMES}; do
            [ -e "$file" ] && return 0
        done
        return 1
    fi
    for file in /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json /usr/local/share/vulkan/icd.d/*.json \
        "${XDG_DATA_HOME:-$HOME/.local/share}"/vulkan/icd.d/*.json /run/opengl-driver/share/vulkan/icd.d/*.json; do
        [ -e "$file" ] && return 0
    done
    return 1
}

have_linker() { command -v cc >/dev/null || command -v gcc >/dev/null || command -v clang >/dev/null; }

# True if packages can be installed without asking anyone.
can_install() {
    command -v apt-get >/dev/null && { [ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null; }
}

# apt_install PACKAGE...
apt_install() {
    local as=()
    [ "$(id -u)" = 0 ] || as=(sudo -n)
    # The output is shown only when something goes wrong.
    local log
    log=$(mktemp)
    if "${as[@]}" apt-get update >"$log" 2>&1 &&
        "${as[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$@" >"$log" 2>&1; then
        rm -f "$log"
    else
        cat "$log" >&2
        rm -f "$log"
        say "apt-get could not install $*; install them by hand, then run this again"
        return 2
    fi
}

# Makes sure of cargo and a linker.
need_build_tools() {
    if ! command -v cargo >/dev/null; then
        say "cargo is missing; install Rust from https://rustup.rs, then run this again"
        return 2
    fi
    if ! have_linker; then
        if can_install; then
            say "no C linker found; installing gcc and libc6-dev"
            apt_install gcc libc6-dev
        else
            say "no C linker found, and no right to install one; as root: apt-get install gcc libc6-dev"
            return 2
        fi
    fi
}

# Makes sure of a Vulkan adapter: a software one where there is none.
need_vulkan() {
    have_vulkan && return 0
    if can_install; then
        say "no Vulkan adapter found; installing the software driver (mesa-vulkan-drivers, libvulkan1)"
        apt_install mesa-vulkan-drivers libvulkan1
    else
        say "no Vulkan adapter found, and no right to install one; as root: apt-get install mesa-vulkan-drivers libvulkan1"
        say "(--device reference renders without an adapter)"
        return 2
    fi
}

# Makes sure of Khronos' validator of SPIR-V.
need_spirv_val() {
    command -v spirv-val >/dev/null && return 0
    if can_install; then
        say "spirv-val not found; installing spirv-tools"
        apt_install spirv-tools
    else
        say "spirv-val not found, and no right to install it; as root: apt-get install spirv-tools"
        return 2
    fi
}

have_browser() { command -v chromium >/dev/null && command -v chromedriver >/dev/null; }

# Makes sure of a browser for the test of `abbe view`'s page, which is not run without.
need_browser() {
    have_browser && return 0
    can_install || return 0
    say "no chromium and chromedriver; installing chromium and chromium-driver"
    apt_install chromium chromium-driver || return 0
}
