//! Lets programs find the library of the world's physics, in this package and in those that name this file.

fn main() {
    if let Some(home) = std::env::var_os("DEP_MUJOCO_HOME") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{}", home.display());
    }
    println!("cargo::rerun-if-env-changed=SUPERBOT_MUJOCO");
}
