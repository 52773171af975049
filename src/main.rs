//! The `abbe` command; everything is in [`abbe::cli`].

use std::process::ExitCode;

/// What drivers on Linux are told by the environment, unless the user says otherwise.
const DRIVER_DEFAULTS: [(&str, &str); 2] = [
    // Mesa looks for a Wayland display on opening any Vulkan instance, and libwayland complains on the terminal where the variable is
    // unset, as it is in containers and services. In a folder that does not exist it finds no display and keeps quiet.
    ("XDG_RUNTIME_DIR", "/nonexistent"),
    // Lavapipe runs a subgroup in one vector. Four lanes instead of eight diverge less: with Mesa 22.3, rays/s times 1.0 (Cornell box),
    // 1.08 (bunny mesh), 1.25 (pool).
    ("LP_NATIVE_VECTOR_WIDTH", "128"),
];

fn main() -> ExitCode {
    if cfg!(target_os = "linux") {
        for (name, value) in DRIVER_DEFAULTS {
            if std::env::var_os(name).is_none() {
                // SAFETY: nothing has started a thread yet that could read the environment.
                unsafe { std::env::set_var(name, value) }
            }
        }
    }
    abbe::cli::main()
}
