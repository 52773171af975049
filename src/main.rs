//! The `abbe` command; everything is in [`abbe::cli`].

use std::process::ExitCode;

#[global_allocator]
static MEMORY: abbe::memory::Counted = abbe::memory::Counted;

fn main() -> ExitCode {
    // Mesa looks for a Wayland display on opening any Vulkan instance, and libwayland complains on the terminal where XDG_RUNTIME_DIR is unset,
    // as it is in containers and services. In a folder that does not exist it finds no display and keeps quiet.
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: nothing has started a thread yet that could read the environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", "/nonexistent") }
    }
    abbe::cli::main()
}
