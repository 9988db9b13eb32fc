//! Has programs find the library of the simulator's physics.

fn main() {
    if let Some(home) = std::env::var_os("DEP_MUJOCO_HOME") {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{}", home.display());
    }
    println!("cargo::rerun-if-changed=build.rs");
}
