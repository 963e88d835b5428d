//! Selects the link scripts: the image of the real board uses `link.x` of cortex-m-rt and the root `memory.x`, the images for
//! the emulator use `qemu_mps2.ld`.

fn main() {
    println!("cargo:rerun-if-changed=qemu_mps2.ld");
    println!("cargo:rerun-if-changed=../memory.x");
    let bare_metal = std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "none");
    if !bare_metal {
        return;
    }
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    if std::env::var_os("CARGO_FEATURE_BOARD_QEMU_MPS2").is_some() {
        println!("cargo:rustc-link-arg-bin=qemu_mps2=-T{here}/qemu_mps2.ld");
        println!("cargo:rustc-link-arg-bin=qemu_mps2=-Tdefmt.x");
        println!("cargo:rustc-link-arg-examples=-T{here}/qemu_mps2.ld");
        println!("cargo:rustc-link-arg-examples=-Tdefmt.x");
    }
    if std::env::var_os("CARGO_FEATURE_BOARD_NUCLEO_G474RE").is_some() {
        println!("cargo:rustc-link-arg-bin=nucleo_g474re=-Tlink.x");
        println!("cargo:rustc-link-arg-bin=nucleo_g474re=-Tdefmt.x");
    }
}
