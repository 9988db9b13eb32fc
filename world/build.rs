//! Finds MuJoCo where `./x` puts it, and makes bindings for the few functions that the world calls.

use std::env;
use std::path::{Path, PathBuf};

/// The version that `./x` pins.
const VERSION: &str = "4.0.1";

const FUNCTIONS: [&str; 9] = [
    "mj_parseXMLString",
    "mj_compile",
    "mj_deleteSpec",
    "mj_deleteModel",
    "mj_makeData",
    "mj_deleteData",
    "mj_forward",
    "mj_step",
    "mj_contactForce",
];

fn main() {
    println!("cargo::rerun-if-env-changed=SUPERBOT_MUJOCO");
    let home = home();
    let library = home.join(format!("libmujoco.so.{VERSION}"));
    let header = home.join("include/mujoco/mujoco.h");
    for path in [&library, &header] {
        println!("cargo::rerun-if-changed={}", path.display());
        assert!(
            path.exists(),
            "there is no {}: `./x setup` fetches MuJoCo {VERSION}, or name its folder in SUPERBOT_MUJOCO",
            path.display()
        );
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("Cargo sets it"));
    bindgen::builder()
        .header(header.to_string_lossy())
        .clang_arg(format!("-I{}", home.join("include").display()))
        .allowlist_function(FUNCTIONS.join("|"))
        .allowlist_var("mju_user_warning|mjNEQDATA")
        .default_enum_style(bindgen::EnumVariation::ModuleConsts)
        .layout_tests(false)
        .generate_comments(false)
        .generate()
        .unwrap_or_else(|error| panic!("bindings of {}: {error}", header.display()))
        .write_to_file(out.join("bindings.rs"))
        .expect("the bindings can be written");
    println!("cargo::rustc-link-search=native={}", home.display());
    println!("cargo::rustc-link-arg=-Wl,-rpath,{}", home.display());
    println!("cargo::rustc-link-lib=dylib:+verbatim=libmujoco.so.{VERSION}");
    // For the programs of other packages: DEP_MUJOCO_HOME.
    println!("cargo::metadata=home={}", home.display());
}

/// The directory of MuJoCo. A relative path starts at the workspace, which is not where Cargo runs this
/// script. An empty path counts as none, as for `./x`.
fn home() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let named = env::var_os("SUPERBOT_MUJOCO").filter(|home| !home.is_empty());
    root.join(named.unwrap_or_else(|| format!("target/tools/mujoco-{VERSION}/mujoco").into()))
}
